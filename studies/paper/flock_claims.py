"""The paper's claims about the flock (Sections V and VI), measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays
from flockesc_env.scenario.objectives import ObjectiveSpec
from studies.paper.claims import Claim, Quantity, between, claim, exactly, mean, quantiles, share
from studies.paper.plan import AIMED_GRID, FLOCK, FLOCK_GRID, OFFSETS, PAPER_OBJECTIVES, SHOWN_FLOCK_RANGES

PRINTED_COMPONENTS = 12
FEW_COMPONENTS = 2 * PRINTED_COMPONENTS  # the largest number that counts as a handful, or as the paper's 12
PRINTED_BEST = 10.0
SHORT = (10.0, 30.0)  # the ranges in m that the paper recommends for the minimum distance
VISIBLE = 0.5  # the smallest difference in m that Figure 9a shows

EDGE = 50.0  # smallest offset in m at which the predator crosses the flock's edge: half of its side
_GRID, _AIMED = np.array(FLOCK_GRID), np.array(AIMED_GRID)


def flock_claims(results: dict[str, Arrays]) -> list[Claim]:
    """Return the rows about the flock, in the paper's order."""
    curves, grid = results["curves"], results["grid flock"]
    literal = results["literal flock"]["num_components"][0]
    aimed = {offset: results[f"aimed {offset:g}"] for offset in OFFSETS}
    return [
        *_connectivity(curves["num_components"][:, :, 1:], literal),
        *_mean_distance(curves["mean_distance"], grid["min_mean_distance"]),
        *_minimum_distance(grid["min_min_distance"]),
        *(_handful(spec, grid[spec.name], grid["num_components"]) for spec in PAPER_OBJECTIVES),
        *(_edge(spec, aimed) for spec in PAPER_OBJECTIVES),
    ]


@dataclass(frozen=True)
class RangeRow:
    """Objectives in m, and components at 12 s, of one fixed range in m, in expectation."""

    interaction_range: float
    min_mean_distance: Estimate
    min_min_distance: Estimate
    num_components: Estimate


def by_range(grid: Arrays) -> tuple[RangeRow, ...]:
    """Return the objectives under some ranges, in expectation."""
    columns = ("min_mean_distance", "min_min_distance", "num_components")
    return tuple(
        RangeRow(rho, *(stats.mean(grid[name][FLOCK_GRID.index(rho)].astype(float)) for name in columns))
        for rho in (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)
    )


def dominates(distance: FloatArray, tolerance: float = 0.0) -> NDArray[np.bool]:
    """Return where the curve of rho = 10 lies above both others, shape (.., times).

    ``distance`` has a first axis over ``SHOWN_FLOCK_RANGES``.
    """
    at_0, at_10, at_100 = distance
    above: NDArray[np.bool] = at_10 >= np.maximum(at_0, at_100) - tolerance
    return above


def gain_of_100(values: FloatArray) -> FloatArray:
    """Return an objective under 100 m minus that under 10 m from values by ``AIMED_GRID`` and flock."""
    gain: FloatArray = values[AIMED_GRID.index(100.0)] - values[AIMED_GRID.index(PRINTED_BEST)]
    return gain


def _connectivity(components: NDArray[np.int64], literal: NDArray[np.int64]) -> list[Claim]:
    """Return the rows about components by range, flock and time, and at the end under the printed law."""
    at_0, at_10, at_100 = components  # shape (flocks, times)
    at_end = at_10[:, -1].astype(float)
    average = stats.mean(at_end)
    return [
        claim(
            "V, Fig. 6",
            "rho = 100 m: the flock stays connected at all times.",
            "one component at every t > 0",
            np.all(at_100 == 1, axis=-1),
            "flocks with one component at all times",
        ),
        claim(
            "V, Fig. 7",
            f"rho = 10 m: the flock breaks up into {PRINTED_COMPONENTS} components.",
            f"exactly {PRINTED_COMPONENTS} at 12 s; the mean rounds to {PRINTED_COMPONENTS}",
            at_end == PRINTED_COMPONENTS,
            Quantity("mean number at t = 12 s", average),
            quantiles("median, and range of 95 % of the flocks", at_end, digits=0),
            f"flocks with exactly {PRINTED_COMPONENTS}",
            in_expectation=between(average, PRINTED_COMPONENTS - 0.5, PRINTED_COMPONENTS + 0.5),
        ),
        claim(
            "V, Eq. 11",
            f"The printed equations (no step that keeps the speed) give {PRINTED_COMPONENTS} components.",
            f"at most {FEW_COMPONENTS} components at 12 s under the printed law; so is the mean",
            literal <= FEW_COMPONENTS,
            mean("mean number at t = 12 s, printed law", literal),
            exactly("smallest number of a flock", literal.min(), digits=0),
            in_expectation=literal.mean() <= FEW_COMPONENTS,
            is_reading=True,
        ),
        claim(
            "V, Fig. 8",
            "rho = 0: no connectivity at all.",
            "300 components at every t > 0",
            np.all(at_0 == FLOCK.num_agents, axis=-1),
            "flocks with 300 components at all times",
        ),
    ]


def _mean_distance(distance: FloatArray, values: FloatArray) -> list[Claim]:
    """Return the rows about distances by range, flock and time, and J_mean by range of the grid and flock."""
    average = distance.mean(axis=1)  # shape (ranges, times)
    shortfall = np.max(np.maximum(average[0], average[2]) - average[1])
    at_0, at_10, at_100 = (values[FLOCK_GRID.index(rho)] for rho in SHOWN_FLOCK_RANGES)
    best, best_of_flock = stats.argmax(_GRID, values), _GRID[np.argmax(values, axis=0)]
    is_reached = np.argmin(distance, axis=-1) < FLOCK.num_steps
    is_nearly_above = np.all(dominates(distance, VISIBLE), axis=-1)
    return [
        claim(
            "V, Fig. 9a",
            "The mean distance under rho = 10 m exceeds that under 0 and 100 m at all t.",
            "the curve of 10 m is at or above both others at all t; so is the mean curve",
            np.all(dominates(distance), axis=-1),
            "flocks in which it does at all t",
            share(f"the same with a tolerance of {VISIBLE:g} m", is_nearly_above),
            exactly("times at which the mean curves do", dominates(average).mean(), "%", 1),
            exactly("largest shortfall of the mean curve", shortfall, "m", 3),
            in_expectation=dominates(average).all(),
        ),
        claim(
            "V, Fig. 9",
            "J_mean under rho = 10 m is larger than under 0 and 100 m.",
            "J_mean is the largest of the three under 10 m; so is its mean",
            at_10 > np.maximum(at_0, at_100),
            "flocks in which it is",
            mean("J_mean(10) - J_mean(0), paired", at_10 - at_0, "m"),
            mean("J_mean(10) - J_mean(100), paired", at_10 - at_100, "m"),
            in_expectation=at_10.mean() > max(at_0.mean(), at_100.mean()),
        ),
        claim(
            "V, Fig. 9b",
            "rho* = 10 m (J_mean; grid of 1 m up to 100 m).",
            "a flock's best range is within 2.5 m of 10 m; so is the best range in expectation",
            np.abs(best_of_flock - PRINTED_BEST) <= 2.5,
            Quantity("best range in expectation", best, "m", 0),
            quantiles("best range of a single flock: median, and range of 95 %", best_of_flock, "m", 0),
            "flocks whose best range is within 2.5 m of 10 m",
            in_expectation=between(best, PRINTED_BEST - 2.5, PRINTED_BEST + 2.5),
        ),
        claim(
            "V, Eq. 12",
            "The 12 s that are simulated contain the minimum over all t >= 0.",
            "the minimum is reached before 12 s under 0, 10 and 100 m; so is that of the mean curves",
            np.all(is_reached, axis=0),
            *(
                share(f"flocks with the minimum before 12 s, rho = {rho:g} m", row)
                for rho, row in zip(SHOWN_FLOCK_RANGES, is_reached, strict=True)
            ),
            in_expectation=(np.argmin(average, axis=-1) < FLOCK.num_steps).all(),
            is_reading=True,
        ),
    ]


def _minimum_distance(values: FloatArray) -> list[Claim]:
    best, best_of_flock = stats.argmax(_GRID, values), _GRID[np.argmax(values, axis=0)]
    at_0, at_100 = values[0], values[-1]
    first, last = map(FLOCK_GRID.index, SHORT)
    at_10_to_30 = values[first : last + 1].mean(axis=0)
    return [
        claim(
            "V, Fig. 10b",
            "The best range for the minimum distance lies between 10 and 30 m.",
            "a flock's best range (J_min) is in 10 to 30 m; so is the best range in expectation",
            (best_of_flock >= SHORT[0]) & (best_of_flock <= SHORT[1]),
            Quantity("best range in expectation", best, "m", 0),
            quantiles("best range of a single flock: median, and range of 95 %", best_of_flock, "m", 0),
            "flocks whose best range is in 10 to 30 m",
            in_expectation=between(best, *SHORT),
        ),
        claim(
            "V, Fig. 10",
            "Ranges of 10 to 30 m keep the predator farther from the nearest agent than 0 and 100 m do.",
            "mean J_min over 10, 11, .., 30 m exceeds J_min under 0 and 100 m; so do the means over flocks",
            at_10_to_30 > np.maximum(at_0, at_100),
            "flocks in which their mean J_min exceeds both",
            mean("J_min(10..30) - J_min(0), paired", at_10_to_30 - at_0, "m"),
            mean("J_min(10..30) - J_min(100), paired", at_10_to_30 - at_100, "m"),
            in_expectation=at_10_to_30.mean() > max(at_0.mean(), at_100.mean()),
        ),
    ]


def _handful(spec: ObjectiveSpec, values: FloatArray, components: NDArray[np.int64]) -> Claim:
    """Return the row about the components at 12 s under the best range, from values by range and flock."""
    best_of_flock = np.argmax(values, axis=0)
    number = components[best_of_flock, np.arange(len(best_of_flock))].astype(float)
    at_best = stats.argmax(components.mean(axis=1), values)  # with the interval of the choice of the range
    return claim(
        "VI, abstract",
        f"The best range breaks the flock up into a handful of components ({spec.symbol}).",
        f"a flock's best range leaves 2 to {FEW_COMPONENTS} components at 12 s (at most twice as many as in"
        " Figure 7); so does the best range in expectation",
        (number >= 2) & (number <= FEW_COMPONENTS),
        Quantity(f"components under the best range in expectation ({spec.symbol})", at_best),
        quantiles("components under a flock's own best range: median, and range of 95 %", number, digits=0),
        f"flocks with 2 to {FEW_COMPONENTS} under their own best range",
        in_expectation=between(at_best, 2, FEW_COMPONENTS),
        is_reading=spec.name == "min_min_distance",
    )


def _edge(spec: ObjectiveSpec, aimed: dict[float, Arrays]) -> Claim:
    """Return the row about an objective, from outcomes by the predator's offset."""
    name, at_edge = spec.symbol, [offset for offset in OFFSETS if offset >= EDGE]
    values = {offset: found[spec.name] for offset, found in aimed.items()}
    margin = {offset: gain_of_100(rows) for offset, rows in values.items()}
    measured = []
    for offset in OFFSETS[::2]:
        best = stats.argmax(_AIMED, values[offset])
        measured.append(Quantity(f"best range at offset {offset:g} m", best, "m", 1))
        what = f"{name}(100) - {name}(10) at offset {offset:g} m, paired"
        measured.append(mean(what, margin[offset], "m"))
    return claim(
        "VI",
        f"Against an attack on the flock's edge full connectivity is best ({name}).",
        "100 m beats the 10 m of Figure 9 at all these offsets; so do the means",
        np.all([margin[offset] > 0 for offset in at_edge], axis=0),
        f"flocks in which 100 m beats 10 m at offsets >= {EDGE:g} m",
        *measured,
        in_expectation=all(margin[offset].mean() > 0 for offset in at_edge),
        is_reading=name == "J_min",
    )
