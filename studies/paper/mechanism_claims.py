"""The paper's explanation of its result, tested without warnings, and without the escape force."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.jobs import Arrays
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES, LINE_OBJECTIVES, ObjectiveSpec
from studies.measurements import means
from studies.paper import plan
from studies.paper.claims import Claim, Quantity, above_zero, claim
from studies.robustness.survey import Finding, choose

WARNING = "Some connectivity helps because agents close to the predator pass information on to others."

SECTION = "I, "  # what the places of these claims start with: the paper's introduction
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
    kind = "captures" if spec.requires == "capture_radius" else "control"
    values: FloatArray = results[plan.control(scenario, strength, kind)][spec.name]
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
        return Controlled(
            where=f"{SECTION}{spec.symbol}" + ("" if scenario == plan.PAPER else f", {scenario}"),
            spec=spec,
            grid=plan.CONTROL_GRID,
            short=10.0,
            full=100.0,
            without=flock_values(results, scenario, plan.NO_FORCE, spec),
            fleeing=flock_values(results, scenario, plan.PAPER_FORCE, spec),
        )

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
    line = Controlled(
        where=f"{SECTION}the line",
        spec=spec,
        grid=plan.LINE_GRID,
        short=0.1,
        full=1.0,
        without=results["fearless line"][spec.name],
        fleeing=results["grid linear"][spec.name],
    )
    adds = "the force adds more under 0.1 than under 0; so it does in the mean"
    return [*rows, _difference(line, WARNING, 0.0, adds), _masking(line), _trade_off(line)]


def _blocking(found: Controlled, results: Mapping[str, Arrays]) -> Claim:
    """Return the claim for a flock: the control takes the warning away, and nothing else."""
    spec = found.spec
    nobody, short = map(found.shown, plan.SHORT_RANGES)
    blocked = results["blocked captures" if spec.requires == "capture_radius" else "blocked"][spec.name]
    hearing = found.fleeing[[found.grid.index(rho) for rho in plan.SHORT_RANGES]]
    gain, gain_blocked = hearing[1] - hearing[0], blocked[1] - blocked[0]
    what = f"{spec.symbol} at {short} minus that at {nobody}"
    return claim(
        found.where,
        WARNING,
        f"blocking removes more than half of what {short} gains over {nobody}; so it does in the mean",
        gain / 2 > gain_blocked,
        found.quantity(f"what blocking removes of the gain of {short} over {nobody}", gain - gain_blocked),
        found.quantity(f"{what}, with warnings", gain),
        found.quantity(f"{what}, with blocked warnings", gain_blocked),
        f"{found.trials} in which blocking removes more than half",
        in_expectation=above_zero(mean(gain / 2 - gain_blocked)),
        is_reading=spec.name != "min_mean_distance",
    )


def _masking(found: Controlled) -> Claim:
    says = "Too much connectivity hurts because the consensus force masks the repulsive force."
    short, full = found.shown(found.short), found.shown(found.full)
    adds = f"the force adds less under {full} than under {short}; so it does in the mean"
    return _difference(found, says, found.full, adds)


def _difference(found: Controlled, says: str, other: float, holds_if: str) -> Claim:
    """Return the claim that the force adds more under the paper's best range than under another one."""
    own, compared = found.grid.index(found.short), found.grid.index(other)
    short, second = found.shown(found.short), found.shown(other)
    added = found.fleeing - found.without
    more = added[own] - added[compared]
    average = mean(more)
    pair = f"{found.spec.symbol} at {short} minus that at {second}"
    return claim(
        found.where,
        says,
        holds_if,
        more > 0,
        found.quantity(f"what the force adds, at {short} minus at {second}", average),
        f"{found.trials} in which it is above 0",
        found.quantity(f"what the force adds at {short}", added[own]),
        found.quantity(f"what the force adds at {second}", added[compared]),
        found.quantity(f"{pair}, without the force", found.without[own] - found.without[compared]),
        found.quantity(f"{pair}, with the force", found.fleeing[own] - found.fleeing[compared]),
        in_expectation=above_zero(average),
        is_reading=found.spec.name != "min_min_distance",  # which favors the claim most
    )


def _trade_off(found: Controlled, others: Mapping[str, FloatArray] | None = None) -> Claim:
    """Return the claim that only the force makes an intermediate range best.

    Best ranges are chosen on the first half of the flocks or lines, margins measured on the second half.
    ``others`` has values under other escape forces by their names.
    """
    without, fleeing = choose(found.grid, found.without), choose(found.grid, found.fleeing)
    half = found.without.shape[1] // 2

    def margin(values: FloatArray) -> FloatArray:
        """Return the gain of the best range with the force over the better end of the grid."""
        measured = values[:, half:]
        gain: FloatArray = measured[fleeing.index] - np.maximum(measured[0], measured[-1])
        return gain

    both = found.fleeing[fleeing.index, half:] - found.without[without.index, half:]
    ends = {"without the force": without, "with the force": fleeing}
    ranges = ends | {name: choose(found.grid, values) for name, values in (others or {}).items()}
    unit = ("m", 0) if found.spec.model == "flock" else ("", 2)
    longest, gains = found.shown(found.grid[-1]), []
    for name, choice in ends.items():
        gains.append(found.quantity(f"its gain over 0 {name}", choice.gain_over_zero))
        gains.append(found.quantity(f"its gain over {longest} {name}", choice.gain_over_longest))
    return claim(
        found.where,
        "The trade-off between warning and consensus makes an intermediate range best.",
        "the best range gains more over the better end of the grid with the force than without; in the mean"
        " an intermediate range is best with the force, and none is without",
        margin(found.fleeing) > margin(found.without),
        *(Quantity(f"best range {name}", choice.best, *unit) for name, choice in ranges.items()),
        *gains,
        found.quantity("at the best range without the force", without.value),
        found.quantity("at the best range with the force", fleeing.value),
        found.quantity("at the best ranges, with the force minus without", both),
        f"{found.trials} whose margin over both ends is larger with the force",
        in_expectation=fleeing.finding is Finding.INTERIOR and without.finding is not Finding.INTERIOR,
        is_reading=found.where != f"{SECTION}J_mean",
    )
