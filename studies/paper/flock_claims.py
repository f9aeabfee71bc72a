"""The paper's claims about the flock (Sections V and VI), measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common import stats
from flockesc_env.common.stats import FloatArray
from flockesc_env.jobs import Arrays
from studies.paper.claims import (
    Claim,
    Quantity,
    RangeRow,
    claim,
    every,
    exactly,
    is_clear,
    mean,
    quantiles,
    share,
)
from studies.paper.plan import (
    AIMED_GRID,
    FLOCK,
    FLOCK_GRID,
    FULL_RANGE,
    OFFSETS,
    PAPER_OBJECTIVES,
    SHOWN_FLOCK_RANGES,
)

PRINTED_COMPONENTS = 12
PRINTED_BEST = 10.0
SHORT = (10.0, 30.0)
"""The ranges in m that the paper recommends for the minimum distance."""

VISIBLE = 0.5
"""The smallest difference in m that Figure 9a shows."""

EDGE = 50.0
"""Smallest offset in m at which the predator's path crosses the flock's edge: half of the flock's side."""

_TABLE_RANGES = (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)
_COLUMNS = (*(spec.column for spec in PAPER_OBJECTIVES), "num_components")
_NONE, _SHORT, _FULL = range(3)
_GRID = np.array(FLOCK_GRID)
_AIMED = np.array(AIMED_GRID)
_FULL_AT, _PRINTED_AT = AIMED_GRID.index(FULL_RANGE), AIMED_GRID.index(PRINTED_BEST)


def flock_claims(results: dict[str, Arrays]) -> list[Claim]:
    """Return the rows about the flock, in the paper's order."""
    curves, grid = results["curves"], results["grid flock"]
    aimed = {offset: results[f"aimed {offset:g}"] for offset in OFFSETS}
    return [
        *_connectivity(curves, results["literal flock"]),
        *_mean_distance(curves, grid),
        _horizon(curves),
        *_minimum_distance(grid),
        *_edge(aimed),
    ]


def by_range(grid: Arrays) -> tuple[RangeRow, ...]:
    """Return the objectives under some ranges, in expectation."""
    return tuple(
        RangeRow(rho, *(stats.mean(grid[name][FLOCK_GRID.index(rho)].astype(float)) for name in _COLUMNS))
        for rho in _TABLE_RANGES
    )


def dominates(distance: FloatArray, tolerance: float = 0.0) -> NDArray[np.bool]:
    """Return where the curve of rho = 10 lies above both others, shape (.., times)."""
    others = np.maximum(distance[_NONE], distance[_FULL])
    above: NDArray[np.bool] = distance[_SHORT] >= others - tolerance
    return above


def _connectivity(curves: Arrays, literal: Arrays) -> list[Claim]:
    components = curves["num_components"][:, :, 1:]
    whole, alone = every(components[_FULL] == 1, -1), every(components[_NONE] == FLOCK.num_agents, -1)
    at_end = components[_SHORT, :, -1].astype(float)
    as_many, average = at_end == PRINTED_COMPONENTS, stats.mean(at_end)
    printed, most = literal["num_components"][0], 2 * PRINTED_COMPONENTS
    return [
        claim(
            "V, Fig. 6",
            "rho = 100 m: the flock stays connected at all times.",
            "one component at every t > 0",
            whole,
            share("flocks with one component at all times", whole),
        ),
        claim(
            "V, Fig. 7",
            f"rho = 10 m: the flock breaks up into {PRINTED_COMPONENTS} components.",
            f"exactly {PRINTED_COMPONENTS} at 12 s; the mean rounds to {PRINTED_COMPONENTS}",
            as_many,
            Quantity("mean number at t = 12 s", average),
            quantiles("median, and range of 95 % of the flocks", at_end, digits=0),
            share(f"flocks with exactly {PRINTED_COMPONENTS}", as_many),
            in_expectation=round(average.mean) == PRINTED_COMPONENTS,
            mean_is_clear=is_clear(average, PRINTED_COMPONENTS - 0.5, PRINTED_COMPONENTS + 0.5),
        ),
        claim(
            "V, Eq. 11",
            f"The printed equations (no step that keeps the speed) give {PRINTED_COMPONENTS} components.",
            f"at most {most} components at 12 s under the printed law; so is the mean",
            printed <= most,
            mean("mean number at t = 12 s, printed law", printed),
            exactly("smallest number of a flock", printed.min(), digits=0),
            in_expectation=printed.mean() <= most,
            is_reading=True,
        ),
        claim(
            "V, Fig. 8",
            "rho = 0: no connectivity at all.",
            "300 components at every t > 0",
            alone,
            share("flocks with 300 components at all times", alone),
        ),
    ]


def _mean_distance(curves: Arrays, grid: Arrays) -> list[Claim]:
    distance, values = curves["mean_distance"], grid["min_mean_distance"]
    average = distance.mean(axis=1)
    dominant, visibly = every(dominates(distance), -1), every(dominates(distance, VISIBLE), -1)
    shown = np.array([values[FLOCK_GRID.index(rho)] for rho in SHOWN_FLOCK_RANGES])
    wins = (shown[_SHORT] > shown[_NONE]) & (shown[_SHORT] > shown[_FULL])
    own = _GRID[np.argmax(values, axis=0)]
    best = stats.argmax(_GRID, values)
    near = np.abs(own - PRINTED_BEST) <= 2.5
    behind = np.max(np.maximum(average[_NONE], average[_FULL]) - average[_SHORT])
    return [
        claim(
            "V, Fig. 9a",
            "The mean distance under rho = 10 m exceeds that under 0 and 100 m at all t.",
            "the curve of 10 m is at or above both others at all t; so is the mean curve",
            dominant,
            share("flocks in which it does at all t", dominant),
            share(f"the same with a tolerance of {VISIBLE:g} m", visibly),
            exactly("times at which the mean curves do", dominates(average).mean(), "%", 1),
            exactly("largest shortfall of the mean curve", behind, "m", 3),
            in_expectation=dominates(average).all(),
        ),
        claim(
            "V, Fig. 9",
            "J_mean under rho = 10 m is larger than under 0 and 100 m.",
            "J_mean is the largest of the three under 10 m; so is its mean",
            wins,
            share("flocks in which it is", wins),
            mean("J_mean(10) - J_mean(0), paired", shown[_SHORT] - shown[_NONE], "m"),
            mean("J_mean(10) - J_mean(100), paired", shown[_SHORT] - shown[_FULL], "m"),
            in_expectation=np.argmax(shown.mean(axis=1)) == _SHORT,
        ),
        claim(
            "V, Fig. 9b",
            "rho* = 10 m (J_mean; grid of 1 m up to 100 m).",
            "a flock's best range is within 2.5 m of 10 m; so is the best range in expectation",
            near,
            Quantity("best range in expectation", best, "m", 0),
            quantiles("best range of a single flock: median, and range of 95 %", own, "m", 0),
            share("flocks whose best range is within 2.5 m of 10 m", near),
            in_expectation=abs(best.mean - PRINTED_BEST) <= 2.5,
            mean_is_clear=is_clear(best, PRINTED_BEST - 2.5, PRINTED_BEST + 2.5),
        ),
    ]


def _horizon(curves: Arrays) -> Claim:
    distance = curves["mean_distance"]
    reached = np.argmin(distance, axis=-1) < FLOCK.num_steps
    return claim(
        "V, Eq. 12",
        "The 12 s that are simulated contain the minimum over all t >= 0.",
        "the minimum is reached before 12 s under 0, 10 and 100 m; so is that of the mean curves",
        every(reached, 0),
        *(
            share(f"flocks with the minimum before 12 s, rho = {rho:g} m", row)
            for rho, row in zip(SHOWN_FLOCK_RANGES, reached, strict=True)
        ),
        in_expectation=(np.argmin(distance.mean(axis=1), axis=-1) < FLOCK.num_steps).all(),
        is_reading=True,
    )


def _minimum_distance(grid: Arrays) -> list[Claim]:
    values = grid["min_min_distance"]
    best = stats.argmax(_GRID, values)
    own = _GRID[np.argmax(values, axis=0)]
    inside = (own >= SHORT[0]) & (own <= SHORT[1])
    middle = values[FLOCK_GRID.index(SHORT[0]) : FLOCK_GRID.index(SHORT[1]) + 1].mean(axis=0)
    none, full = values[0], values[FLOCK_GRID.index(FULL_RANGE)]
    wins = (middle > none) & (middle > full)
    return [
        claim(
            "V, Fig. 10b",
            "The best range for the minimum distance lies between 10 and 30 m.",
            "a flock's best range (J_min) is in 10 to 30 m; so is the best range in expectation",
            inside,
            Quantity("best range in expectation", best, "m", 0),
            quantiles("best range of a single flock: median, and range of 95 %", own, "m", 0),
            share("flocks whose best range is in 10 to 30 m", inside),
            in_expectation=SHORT[0] <= best.mean <= SHORT[1],
            mean_is_clear=is_clear(best, *SHORT),
        ),
        claim(
            "V, Fig. 10",
            "Ranges of 10 to 30 m keep the predator farther from the nearest agent than 0 and 100 m do.",
            "mean J_min over 10, 11, .., 30 m exceeds J_min under 0 and 100 m; so do the means over flocks",
            wins,
            share("flocks in which their mean J_min exceeds both", wins),
            mean("J_min(10..30) - J_min(0), paired", middle - none, "m"),
            mean("J_min(10..30) - J_min(100), paired", middle - full, "m"),
            in_expectation=middle.mean() > max(none.mean(), full.mean()),
        ),
    ]


def _edge(aimed: dict[float, Arrays]) -> list[Claim]:
    rows = []
    at_edge = [offset for offset in OFFSETS if offset >= EDGE]
    for spec in PAPER_OBJECTIVES:
        name = spec.symbol
        values = {offset: results[spec.column] for offset, results in aimed.items()}
        margin = {offset: row[_FULL_AT] - row[_PRINTED_AT] for offset, row in values.items()}
        wins = every(np.array([margin[offset] > 0 for offset in at_edge]), 0)
        measured = [
            figure
            for offset in OFFSETS[::2]
            for figure in (
                Quantity(f"best range at offset {offset:g} m", stats.argmax(_AIMED, values[offset]), "m", 1),
                mean(f"{name}(100) - {name}(10) at offset {offset:g} m, paired", margin[offset], "m"),
            )
        ]
        rows.append(
            claim(
                "VI",
                f"Against an attack on the flock's edge full connectivity is best ({name}).",
                "100 m beats the 10 m of Figure 9 at all these offsets; so do the means",
                wins,
                share(f"flocks in which 100 m beats 10 m at offsets >= {EDGE:g} m", wins),
                *measured,
                in_expectation=all(margin[offset].mean() > 0 for offset in at_edge),
                is_reading=name == "J_min",
            )
        )
    return rows
