"""The paper's explanation of its result, tested without warnings, and without the escape force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.jobs import Arrays
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES, LINE_OBJECTIVES, ObjectiveSpec
from studies.measurements import means
from studies.paper import plan
from studies.paper.claims import Claim, Quantity, claim
from studies.robustness.survey import Finding, choose

WARNING = "Some connectivity helps because agents close to the predator pass information on to others."

SECTION = "I, "
"""What the places of these claims start with: the paper's introduction."""

OBJECTIVES = tuple(FLOCK_OBJECTIVES.values())


@dataclass(frozen=True)
class Controlled:
    """An objective without and with the paper's escape force, shape (ranges, flocks or lines).

    ``short`` is the paper's best range and ``full`` the range of full connectivity, both in the grid.
    """

    where: str
    spec: ObjectiveSpec
    grid: tuple[float, ...]
    short: float
    full: float
    without: FloatArray
    fleeing: FloatArray

    @property
    def trials(self) -> str:
        """The word for realizations."""
        return "flocks" if self.spec.model == "flock" else "lines"

    def shown(self, rho: float) -> str:
        """Return a range with its unit."""
        return f"{rho:g} m" if self.spec.model == "flock" else f"{rho:g}"

    def quantity(self, what: str, value: Estimate | FloatArray) -> Quantity:
        """Return an estimate, or the mean of values, in the unit of the objective."""
        value = value if isinstance(value, Estimate) else mean(value)
        if self.spec.name == "fraction_surviving":
            return Quantity(what, value, "%")
        return Quantity(what, value, self.spec.unit, 2 if self.spec.unit else 4)


def flock_values(
    results: Mapping[str, Arrays], scenario: str, strength: float, spec: ObjectiveSpec
) -> FloatArray:
    """Return an objective of a scenario under an escape force, shape (ranges, flocks)."""
    name = plan.captures if spec.requires == "capture_radius" else plan.control
    values: FloatArray = results[name(scenario, strength)][spec.name]
    return values


def force_table(results: Mapping[str, Arrays]) -> dict[str, tuple[Estimate, ...]]:
    """Return the objectives of the paper's flock by symbol and escape force: "J_mean 10"; one per range."""
    return {
        f"{spec.symbol} {strength:g}": means(flock_values(results, plan.PAPER, strength, spec))
        for spec in OBJECTIVES
        for strength in plan.STRENGTHS
    }


def mechanism_claims(results: Mapping[str, Arrays]) -> list[Claim]:
    """Return the rows about the paper's explanation: warning, masking, and the trade-off between them."""

    def flock(scenario: str, spec: ObjectiveSpec) -> Controlled:
        where = f"{SECTION}{spec.symbol}" + ("" if scenario == plan.PAPER else f", {scenario}")
        both = (
            flock_values(results, scenario, strength, spec) for strength in (plan.NO_FORCE, plan.PAPER_FORCE)
        )
        return Controlled(where, spec, plan.CONTROL_GRID, 10.0, 100.0, *both)

    rows = []
    for spec in OBJECTIVES:
        others = {
            f"with s = {strength:g}": flock_values(results, plan.PAPER, strength, spec)
            for strength in plan.STRENGTHS
            if strength not in {plan.NO_FORCE, plan.PAPER_FORCE}
        }
        paper = flock(plan.PAPER, spec)
        rows += [_blocking(paper, results), _masking(paper), _trade_off(paper, others)]
    for scenario in plan.SCENARIOS:
        for spec in OBJECTIVES:
            is_measured = spec.requires != "capture_radius" or scenario in plan.SURVIVAL_SCENARIOS
            if scenario != plan.PAPER and is_measured:
                rows.append(_trade_off(flock(scenario, spec)))
    spec = LINE_OBJECTIVES["escape_distance"]
    both = (results[name][spec.name] for name in ("fearless line", "grid linear"))
    line = Controlled(f"{SECTION}the line", spec, plan.LINE_GRID, 0.1, 1.0, *both)
    adds = "the force adds more under 0.1 than under 0; so it does in the mean"
    return [*rows, _difference(line, WARNING, 0.0, adds), _masking(line), _trade_off(line)]


def _blocking(found: Controlled, results: Mapping[str, Arrays]) -> Claim:
    """Return the claim for a flock: the control takes the warning away, and nothing else."""
    spec, (nobody, short) = found.spec, map(found.shown, plan.SHORT_RANGES)
    name = "blocked captures" if spec.requires == "capture_radius" else "blocked"
    gains = {}
    for control, values in (
        ("with warnings", found.fleeing[[found.grid.index(rho) for rho in plan.SHORT_RANGES]]),
        ("with blocked warnings", results[name][spec.name]),
    ):
        gains[f"{spec.symbol} at {short} minus that at {nobody}, {control}"] = values[1] - values[0]
    hearing, blocked = gains.values()
    more = mean(hearing / 2 - blocked)
    return claim(
        found.where,
        WARNING,
        f"blocking removes more than half of what {short} gains over {nobody}; so it does in the mean",
        hearing / 2 > blocked,
        found.quantity(f"what blocking removes of the gain of {short} over {nobody}", hearing - blocked),
        *(found.quantity(what, values) for what, values in gains.items()),
        f"{found.trials} in which blocking removes more than half",
        in_expectation=more.mean > 0,
        mean_is_clear=not more.low < 0 < more.high,
        is_reading=spec.name != "min_mean_distance",
    )


def _masking(found: Controlled) -> Claim:
    says = "Too much connectivity hurts because the consensus force masks the repulsive force."
    short, full = found.shown(found.short), found.shown(found.full)
    adds = f"the force adds less under {full} than under {short}; so it does in the mean"
    return _difference(found, says, found.full, adds)


def _difference(found: Controlled, says: str, other: float, holds_if: str) -> Claim:
    """Return the claim that the force adds more under the paper's best range than under another one."""
    ends = (found.short, other)
    without, fleeing = (
        {rho: rows[found.grid.index(rho)] for rho in ends} for rows in (found.without, found.fleeing)
    )
    added = {rho: fleeing[rho] - without[rho] for rho in ends}
    values = added[found.short] - added[other]
    average, symbol = mean(values), found.spec.symbol
    short, second = map(found.shown, ends)
    pair = f"{symbol} at {short} minus that at {second}"
    return claim(
        found.where,
        says,
        holds_if,
        values > 0,
        found.quantity(f"what the force adds, at {short} minus at {second}", average),
        f"{found.trials} in which it is above 0",
        *(found.quantity(f"what the force adds at {found.shown(rho)}", added[rho]) for rho in ends),
        found.quantity(f"{pair}, without the force", without[found.short] - without[other]),
        found.quantity(f"{pair}, with the force", fleeing[found.short] - fleeing[other]),
        in_expectation=average.mean > 0,
        mean_is_clear=not average.low < 0 < average.high,
        is_reading=found.spec.name != "min_min_distance",  # which favors the claim most
    )


def _trade_off(found: Controlled, others: Mapping[str, FloatArray] | None = None) -> Claim:
    without, fleeing = (choose(found.grid, values) for values in (found.without, found.fleeing))
    half = found.without.shape[1] // 2
    margins = [
        values[fleeing.index, half:] - np.maximum(values[0, half:], values[-1, half:])
        for values in (found.fleeing, found.without)
    ]
    both = found.fleeing[fleeing.index, half:] - found.without[without.index, half:]
    ends = {"without the force": without, "with the force": fleeing}
    ranges = ends | {name: choose(found.grid, values) for name, values in (others or {}).items()}
    unit = ("m", 0) if found.spec.model == "flock" else ("", 2)
    longest, gains = found.shown(found.grid[-1]), []
    for name, choice in ends.items():
        gains += [
            found.quantity(f"its gain over 0 {name}", choice.gain_over_zero),
            found.quantity(f"its gain over {longest} {name}", choice.gain_over_longest),
        ]
    return claim(
        found.where,
        "The trade-off between warning and consensus makes an intermediate range best.",
        "the best range gains more over the better end of the grid with the force than without; in the mean"
        " an intermediate range is best with the force, and none is without",
        margins[0] > margins[1],
        *(Quantity(f"best range {name}", choice.best, *unit) for name, choice in ranges.items()),
        *gains,
        found.quantity("at the best range without the force", without.value),
        found.quantity("at the best range with the force", fleeing.value),
        found.quantity("at the best ranges, with the force minus without", both),
        f"{found.trials} whose margin over both ends is larger with the force",
        in_expectation=fleeing.finding is Finding.INTERIOR and without.finding is not Finding.INTERIOR,
        is_reading=found.where != f"{SECTION}J_mean",
    )
