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
    every,
    exactly,
    is_clear,
    judge,
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
    """Return where the curve of rho = 10 lies above both others, shape (.., times).

    Args:
        distance: shape (3, .., times), in the order of ``SHOWN_FLOCK_RANGES``.
        tolerance: how far below them it may lie, in m.
    """
    others = np.maximum(distance[_NONE], distance[_FULL])
    above: NDArray[np.bool] = distance[_SHORT] >= others - tolerance
    return above


def _connectivity(curves: Arrays, literal: Arrays) -> list[Claim]:
    components = curves["num_components"][:, :, 1:]
    whole, alone = every(components[_FULL] == 1, -1), every(components[_NONE] == FLOCK.num_agents, -1)
    at_end = components[_SHORT, :, -1]
    as_many = at_end == PRINTED_COMPONENTS
    average = stats.mean(at_end.astype(float))
    printed = literal["num_components"][0]
    return [
        Claim(
            "V, Fig. 6",
            "rho = 100 m: the flock stays connected at all times.",
            (share("flocks with one component at all times", whole),),
            len(whole),
            "one component at every t > 0",
            judge(whole, in_expectation=bool(whole.all())),
        ),
        Claim(
            "V, Fig. 7",
            f"rho = 10 m: the flock breaks up into {PRINTED_COMPONENTS} components.",
            (
                Quantity("mean number at t = 12 s", average),
                quantiles("median, and range of 95 % of the flocks", at_end.astype(float), digits=0),
                share(f"flocks with exactly {PRINTED_COMPONENTS}", as_many),
            ),
            len(as_many),
            f"exactly {PRINTED_COMPONENTS} at 12 s; the mean rounds to {PRINTED_COMPONENTS}",
            judge(
                as_many,
                in_expectation=round(average.mean) == PRINTED_COMPONENTS,
                mean_is_clear=is_clear(average, PRINTED_COMPONENTS - 0.5, PRINTED_COMPONENTS + 0.5),
            ),
        ),
        Claim(
            "V, Eq. 11",
            f"The printed equations (no step that keeps the speed) give {PRINTED_COMPONENTS} components.",
            (
                mean("mean number at t = 12 s, printed law", printed.astype(float)),
                exactly("smallest number of a flock", printed.min(), digits=0),
            ),
            len(printed),
            f"at most {2 * PRINTED_COMPONENTS} components at 12 s under the printed law; so is the mean",
            judge(
                printed <= 2 * PRINTED_COMPONENTS,
                in_expectation=bool(printed.mean() <= 2 * PRINTED_COMPONENTS),
            ),
            is_reading=True,
        ),
        Claim(
            "V, Fig. 8",
            "rho = 0: no connectivity at all.",
            (share("flocks with 300 components at all times", alone),),
            len(alone),
            "300 components at every t > 0",
            judge(alone, in_expectation=bool(alone.all())),
        ),
    ]


def _mean_distance(curves: Arrays, grid: Arrays) -> list[Claim]:
    distance, values = curves["mean_distance"], grid["min_mean_distance"]
    average = distance.mean(axis=1)
    dominant, visibly = every(dominates(distance), -1), every(dominates(distance, VISIBLE), -1)
    shown = np.array([values[FLOCK_GRID.index(rho)] for rho in SHOWN_FLOCK_RANGES])
    wins = (shown[_SHORT] > shown[_NONE]) & (shown[_SHORT] > shown[_FULL])
    leads = int(np.argmax(shown.mean(axis=1))) == _SHORT
    own = _GRID[np.argmax(values, axis=0)]
    best = stats.argmax(_GRID, values)
    near = np.abs(own - PRINTED_BEST) <= 2.5
    behind = np.max(np.maximum(average[_NONE], average[_FULL]) - average[_SHORT])
    return [
        Claim(
            "V, Fig. 9a",
            "The mean distance under rho = 10 m exceeds that under 0 and 100 m at all t.",
            (
                share("flocks in which it does at all t", dominant),
                share(f"the same with a tolerance of {VISIBLE:g} m", visibly),
                exactly("times at which the mean curves do", dominates(average).mean(), "%", 1),
                exactly("largest shortfall of the mean curve", behind, "m", 3),
            ),
            len(dominant),
            "the curve of 10 m is at or above both others at all t; so is the mean curve",
            judge(dominant, in_expectation=bool(dominates(average).all())),
        ),
        Claim(
            "V, Fig. 9",
            "J_mean under rho = 10 m is larger than under 0 and 100 m.",
            (
                share("flocks in which it is", wins),
                mean("J_mean(10) - J_mean(0), paired", shown[_SHORT] - shown[_NONE], "m"),
                mean("J_mean(10) - J_mean(100), paired", shown[_SHORT] - shown[_FULL], "m"),
            ),
            len(wins),
            "J_mean is the largest of the three under 10 m; so is its mean",
            judge(wins, in_expectation=leads),
        ),
        Claim(
            "V, Fig. 9b",
            "rho* = 10 m (J_mean; grid of 1 m up to 100 m).",
            (
                Quantity("best range in expectation", best, "m", 0),
                quantiles("best range of a single flock: median, and range of 95 %", own, "m", 0),
                share("flocks whose best range is within 2.5 m of 10 m", near),
            ),
            len(own),
            "a flock's best range is within 2.5 m of 10 m; so is the best range in expectation",
            judge(
                near,
                in_expectation=abs(best.mean - PRINTED_BEST) <= 2.5,
                mean_is_clear=is_clear(best, PRINTED_BEST - 2.5, PRINTED_BEST + 2.5),
            ),
        ),
    ]


def _horizon(curves: Arrays) -> Claim:
    distance = curves["mean_distance"]
    reached = np.argmin(distance, axis=-1) < FLOCK.num_steps
    always = every(reached, 0)
    return Claim(
        "V, Eq. 12",
        "The 12 s that are simulated contain the minimum over all t >= 0.",
        tuple(
            share(f"flocks with the minimum before 12 s, rho = {rho:g} m", row)
            for rho, row in zip(SHOWN_FLOCK_RANGES, reached, strict=True)
        ),
        len(always),
        "the minimum is reached before 12 s under 0, 10 and 100 m; so is that of the mean curves",
        judge(
            always,
            in_expectation=bool((np.argmin(distance.mean(axis=1), axis=-1) < FLOCK.num_steps).all()),
        ),
        is_reading=True,
    )


def _minimum_distance(grid: Arrays) -> list[Claim]:
    values = grid["min_min_distance"]
    best = stats.argmax(_GRID, values)
    own = _GRID[np.argmax(values, axis=0)]
    inside = (own >= SHORT[0]) & (own <= SHORT[1])
    short = slice(FLOCK_GRID.index(SHORT[0]), FLOCK_GRID.index(SHORT[1]) + 1)
    middle = values[short].mean(axis=0)
    none, full = values[0], values[FLOCK_GRID.index(FULL_RANGE)]
    wins = (middle > none) & (middle > full)
    return [
        Claim(
            "V, Fig. 10b",
            "The best range for the minimum distance lies between 10 and 30 m.",
            (
                Quantity("best range in expectation", best, "m", 0),
                quantiles("best range of a single flock: median, and range of 95 %", own, "m", 0),
                share("flocks whose best range is in 10 to 30 m", inside),
            ),
            len(own),
            "a flock's best range (J_min) is in 10 to 30 m; so is the best range in expectation",
            judge(
                inside,
                in_expectation=SHORT[0] <= best.mean <= SHORT[1],
                mean_is_clear=is_clear(best, *SHORT),
            ),
        ),
        Claim(
            "V, Fig. 10",
            "Ranges of 10 to 30 m keep the predator farther from the nearest agent than 0 and 100 m do.",
            (
                share("flocks in which their mean J_min exceeds both", wins),
                mean("J_min(10..30) - J_min(0), paired", middle - none, "m"),
                mean("J_min(10..30) - J_min(100), paired", middle - full, "m"),
            ),
            len(wins),
            "mean J_min over 10, 11, .., 30 m exceeds J_min under 0 and 100 m; so do the means over flocks",
            judge(wins, in_expectation=bool(middle.mean() > none.mean() and middle.mean() > full.mean())),
        ),
    ]


def _edge(aimed: dict[float, Arrays]) -> list[Claim]:
    rows = []
    for spec in PAPER_OBJECTIVES:
        name = spec.symbol
        values = {offset: results[spec.column] for offset, results in aimed.items()}
        margin = {offset: row[_FULL_AT] - row[_PRINTED_AT] for offset, row in values.items()}
        at_edge = [offset for offset in OFFSETS if offset >= EDGE]
        wins = every(np.array([margin[offset] > 0 for offset in at_edge]), 0)
        best = {offset: stats.argmax(_AIMED, row) for offset, row in values.items()}
        measured = [
            figure
            for offset in OFFSETS[::2]
            for figure in (
                Quantity(f"best range at offset {offset:g} m", best[offset], "m", 1),
                mean(f"{name}(100) - {name}(10) at offset {offset:g} m, paired", margin[offset], "m"),
            )
        ]
        rows.append(
            Claim(
                "VI",
                f"Against an attack on the flock's edge full connectivity is best ({name}).",
                (share(f"flocks in which 100 m beats 10 m at offsets >= {EDGE:g} m", wins), *measured),
                len(wins),
                "100 m beats the 10 m of Figure 9 at all these offsets; so do the means",
                judge(wins, in_expectation=all(margin[offset].mean() > 0 for offset in at_edge)),
                is_reading=name == "J_min",
            )
        )
    return rows
