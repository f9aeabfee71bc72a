"""The paper's explanation of its result, tested against flocks and lines that do not flee."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, LINE_OBJECTIVES, ObjectiveSpec
from flockesc_env.jobs import Arrays
from studies.paper.claims import Claim, Quantity, judge, share
from studies.paper.plan import (
    CONTROL_GRID,
    FULL_RANGE,
    LINE_GRID,
    NO_FORCE,
    PAPER_FORCE,
    PAPER_WORLD,
    STRENGTHS,
    SURVIVAL_WORLDS,
    WORLDS,
    captures,
    control,
)
from studies.robustness.findings import Choice, Finding, choose

SECTION = "I, "
"""What the places of these claims start with: the paper's introduction."""

_SHORT, _SHORT_LINE = 10.0, 0.1
"""The paper's best ranges."""

_OBJECTIVES = tuple(FLOCK_OBJECTIVES.values())


@dataclass(frozen=True)
class Controlled:
    """An objective without and with the escape force, on the same flocks or lines.

    Attributes:
        where: the place of the claim, with objective and world.
        spec: the objective.
        grid: the ranges.
        short: the paper's best range, in the grid.
        without: the objective without the force, shape (ranges, flocks).
        fleeing: the objective with the paper's force, same shape.
    """

    where: str
    spec: ObjectiveSpec
    grid: tuple[float, ...]
    short: float
    without: FloatArray
    fleeing: FloatArray

    def effect(self, rho: float) -> FloatArray:
        """Return what the force adds to the objective under a range, per flock."""
        at = self.grid.index(rho)
        added: FloatArray = self.fleeing[at] - self.without[at]
        return added

    def difference(self, what: str, values: FloatArray) -> Quantity:
        """Return the mean over flocks of differences of the objective."""
        return self.quantity(what, stats.mean(values))

    def quantity(self, what: str, value: Estimate) -> Quantity:
        """Return an estimate in the unit of the objective; shares are shown in percent."""
        if self.spec.unit:
            return Quantity(what, value, self.spec.unit)
        return Quantity(what, value, "%") if self.spec.name == "survival" else Quantity(what, value, digits=4)

    def range_of(self, what: str, best: Estimate) -> Quantity:
        """Return a best range with the unit of ranges."""
        return Quantity(what, best, *(("m", 0) if self.spec.model == "flock" else ("", 2)))


def flock_values(
    results: Mapping[str, Arrays], world: str, strength: float, spec: ObjectiveSpec
) -> FloatArray:
    """Return an objective of a world under an escape force, shape (ranges, flocks)."""
    name = captures if spec.requires == "capture_radius" else control
    values: FloatArray = results[name(world, strength)][spec.column]
    return values


def mechanism_claims(results: Mapping[str, Arrays]) -> list[Claim]:
    """Return the rows about the paper's explanation: warning, masking, and the trade-off between them."""
    rows = []
    for spec in _OBJECTIVES:
        paper = _flock(results, PAPER_WORLD, spec)
        others = {
            strength: choose(CONTROL_GRID, flock_values(results, PAPER_WORLD, strength, spec))
            for strength in STRENGTHS
            if strength not in {NO_FORCE, PAPER_FORCE}
        }
        rows += [_warning(paper), _masking(paper), _trade_off(paper, others)]
    for world in WORLDS:
        for spec in _OBJECTIVES:
            is_measured = spec.requires != "capture_radius" or world in SURVIVAL_WORLDS
            if world != PAPER_WORLD and is_measured:
                rows.append(_trade_off(_flock(results, world, spec)))
    spec = LINE_OBJECTIVES["escape_distance"]
    free, attacked = (results[name][spec.column] for name in ("fearless line", "grid linear"))
    line = Controlled(f"{SECTION}the line", spec, LINE_GRID, _SHORT_LINE, free, attacked)
    return [*rows, _warning(line), _masking(line), _trade_off(line)]


def force_table(results: Mapping[str, Arrays]) -> dict[str, tuple[Estimate, ...]]:
    """Return the objectives of the paper's flock by symbol and escape force: "J_mean 10"; one per range."""
    return {
        f"{spec.symbol} {strength:g}": tuple(
            stats.mean(row) for row in flock_values(results, PAPER_WORLD, strength, spec)
        )
        for spec in _OBJECTIVES
        for strength in STRENGTHS
    }


def _flock(results: Mapping[str, Arrays], world: str, spec: ObjectiveSpec) -> Controlled:
    where = f"{SECTION}{spec.symbol}" + ("" if world == PAPER_WORLD else f", {world}")
    without, fleeing = (flock_values(results, world, strength, spec) for strength in (NO_FORCE, PAPER_FORCE))
    return Controlled(where, spec, CONTROL_GRID, _SHORT, without, fleeing)


def _warning(found: Controlled) -> Claim:
    helped = found.effect(found.short) - found.effect(0.0)
    short = f"{found.short:g}{_unit(found)}"
    return _difference(
        found,
        "Some connectivity helps because agents close to the predator pass information on to others.",
        f"what the force adds, at {short} minus at 0",
        helped,
        (found.short, 0.0),
        f"the force adds more under {short} than under 0; so it does in the mean",
    )


def _masking(found: Controlled) -> Claim:
    full = FULL_RANGE if found.spec.model == "flock" else 1.0
    masked = found.effect(found.short) - found.effect(full)
    short, longest = f"{found.short:g}{_unit(found)}", f"{full:g}{_unit(found)}"
    return _difference(
        found,
        "Too much connectivity hurts because the consensus force masks the repulsive force.",
        f"what the force adds, at {short} minus at {longest}",
        masked,
        (found.short, full),
        f"the force adds less under {longest} than under {short}; so it does in the mean",
    )


def _difference(
    found: Controlled,
    claim: str,
    what: str,
    values: FloatArray,
    ends: tuple[float, float],
    holds_if: str,
) -> Claim:
    average, is_so = found.difference(what, values), values > 0
    first, second = (found.grid.index(rho) for rho in ends)
    pair = " minus that at ".join(f"{rho:g}{_unit(found)}" for rho in ends)
    effects = (
        *(
            found.difference(f"what the force adds at {rho:g}{_unit(found)}", found.effect(rho))
            for rho in ends
        ),
        found.difference(
            f"{found.spec.symbol} at {pair}, without the force", found.without[first] - found.without[second]
        ),
        found.difference(
            f"{found.spec.symbol} at {pair}, with the force", found.fleeing[first] - found.fleeing[second]
        ),
    )
    return Claim(
        found.where,
        claim,
        (average, share(f"{_trials(found)} in which it is above 0", is_so), *effects),
        len(values),
        holds_if,
        judge(
            is_so,
            in_expectation=average.value.mean > 0,
            mean_is_clear=not average.value.low < 0 < average.value.high,
        ),
        is_reading=found.spec.name != "minimum",  # which favors the claim most
    )


def _trade_off(found: Controlled, others: dict[float, Choice] | None = None) -> Claim:
    without, fleeing = choose(found.grid, found.without), choose(found.grid, found.fleeing)
    half = found.without.shape[1] // 2
    is_so = _margin(found.fleeing, fleeing.index, half) > _margin(found.without, fleeing.index, half)
    both = found.fleeing[fleeing.index, half:] - found.without[without.index, half:]
    return Claim(
        found.where,
        "The trade-off between warning and consensus makes an intermediate range best.",
        (
            found.range_of("best range without the force", without.best),
            found.range_of("best range with the force", fleeing.best),
            *(
                found.range_of(f"best range with s = {strength:g}", choice.best)
                for strength, choice in (others or {}).items()
            ),
            *_gains(found, "without", without),
            *_gains(found, "with", fleeing),
            found.quantity("at the best range without the force", without.value),
            found.quantity("at the best range with the force", fleeing.value),
            found.quantity("at the best ranges, with the force minus without", stats.mean(both)),
            share(f"{_trials(found)} whose margin over both ends is larger with the force", is_so),
        ),
        len(is_so),
        "the best range gains more over the better end of the grid with the force than without; in the mean"
        " an intermediate range is best with the force, and none is without",
        judge(
            is_so,
            in_expectation=fleeing.finding is Finding.INTERIOR and without.finding is not Finding.INTERIOR,
        ),
        is_reading=found.where != f"{SECTION}J_mean",
    )


def _gains(found: Controlled, name: str, choice: Choice) -> Iterator[Quantity]:
    longest = f"{found.grid[-1]:g}{_unit(found)}"
    yield found.quantity(f"its gain over 0 {name} the force", choice.gain_over_zero)
    yield found.quantity(f"its gain over {longest} {name} the force", choice.gain_over_longest)


def _margin(values: FloatArray, at: int, half: int) -> FloatArray:
    """Return by how much a range beats the better end of the grid, for each flock of the second half."""
    margin: FloatArray = values[at, half:] - np.maximum(values[0, half:], values[-1, half:])
    return margin


def _unit(found: Controlled) -> str:
    return " m" if found.spec.model == "flock" else ""


def _trials(found: Controlled) -> str:
    return "flocks" if found.spec.model == "flock" else "lines"
