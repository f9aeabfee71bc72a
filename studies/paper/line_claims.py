"""The paper's claims about the line (Section IV), measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays
from studies.paper.claims import Claim, Quantity, claim, every, mean, share
from studies.paper.plan import (
    BATCH,
    COARSE,
    FORCES,
    FREE_RANGES,
    LINE,
    LINE_GRID,
    PREDATOR_POSITIONS,
    SHOWN_RANGES,
)

PRINTED_CLUSTERS = {0.2: (0.35, 0.69), 0.1: (0.14, 0.40, 0.67, 0.88)}
"""Cluster positions that Figure 3 shows, by range."""

NEAR = 0.05
"""Largest distance at which a cluster counts as being where the paper has it."""

_FIRST = LINE_GRID.index(0.1)
_GRID = np.array(LINE_GRID)


def clusters(final: FloatArray, rho: float) -> FloatArray:
    """Return the positions of the clusters of one steady state, given in rising order."""
    parts = np.split(final, np.flatnonzero(np.diff(final) > rho) + 1)
    return np.array([part.mean() for part in parts])


def line_claims(results: dict[str, Arrays]) -> list[Claim]:
    """Return the rows about the line, in the paper's order."""
    free, attacked = results["free line"], results["attacked line"]
    grids = {force: results[f"grid {force}"] for force in FORCES}
    return [
        *_figure_3(free),
        *_figure_4(attacked),
        *(_best_range(force, grids[force]) for force in FORCES),
        _second_peak(grids["linear"]),
        *_at_best(grids["linear"]),
    ]


def _figure_3(free: Arrays) -> list[Claim]:
    whole = (_counts(free, 1.0) == 1) & (free["mean_offset"][FREE_RANGES.index(1.0)] < 1e-9)
    alone = _counts(free, 0.0) == LINE.num_agents
    rows = [
        claim(
            "IV, Fig. 3a",
            "rho = 1: one cluster, at the average of x(0).",
            "one cluster within 1e-9 of the average",
            whole,
            share("lines with one cluster at the average", whole),
        ),
        claim(
            "IV, Fig. 3d",
            "rho = 0: 100 independent agents.",
            "100 components",
            alone,
            share("lines with 100 components", alone),
        ),
    ]
    for rho, panel in ((0.2, "b"), (0.1, "c")):
        counts, printed = _counts(free, rho), PRINTED_CLUSTERS[rho]
        as_many = counts == len(printed)
        finals = free["final"][FREE_RANGES.index(rho)][as_many]
        found = np.array([clusters(final, rho) for final in finals])
        near = every(np.abs(found - printed) <= NEAR, 1)
        rows += [
            claim(
                f"IV, Fig. 3{panel}",
                f"rho = {rho:g}: {len(printed)} clusters.",
                f"{len(printed)} clusters; no other number is as frequent",
                as_many,
                share(f"lines with {len(printed)}", as_many),
                mean("mean number", counts),
                in_expectation=np.argmax(np.bincount(counts)) == len(printed),
            ),
            claim(
                f"IV, Fig. 3{panel}",
                f"rho = {rho:g}: clusters at {', '.join(f'{x:.2f}' for x in printed)}.",
                f"lines with this number of clusters: all within {NEAR:g} of those printed; so are the means",
                near,
                share(f"lines with all within {NEAR:g}", near),
                *(mean(f"cluster {k + 1}", column) for k, column in enumerate(found.T)),
                in_expectation=(np.abs(found.mean(axis=0) - printed) <= NEAR).all(),
            ),
        ]
    return rows


def _figure_4(attacked: Arrays) -> list[Claim]:
    distance = np.abs(attacked["final"] - LINE.predator_position).min(axis=-1)
    best = SHOWN_RANGES.index(0.1)
    wins = every(distance[best] >= distance, 0)
    rounds = np.round(distance[best], 1) == 0.3
    measured = [
        mean(f"mean d_ss, rho = {rho:g}", row, digits=3)
        for rho, row in zip(SHOWN_RANGES, distance, strict=True)
    ]
    return [
        claim(
            "IV, Fig. 4",
            "Of rho = 1, 0.2, 0.1 and 0, rho = 0.1 keeps the predator farthest.",
            "d_ss(0.1) is the largest of the four; so is its mean",
            wins,
            share("lines in which it does", wins),
            *measured,
            in_expectation=np.argmax(distance.mean(axis=1)) == best,
        ),
        claim(
            "IV, Fig. 4",
            "d_ss(0.1) = 0.3.",
            "d_ss(0.1) rounds to 0.3; so does its mean",
            rounds,
            share("lines that round to 0.3", rounds),
            measured[best],
            in_expectation=round(distance[best].mean(), 1) == 0.3,
        ),
    ]


def _best_range(force: str, grid: Arrays) -> Claim:
    distance = grid["escape_distance"]
    chosen = np.argmax(_batches(distance[COARSE]), axis=0) == 1
    own = np.argmax(distance[COARSE], axis=0) == 1
    everywhere = stats.argmax(_GRID[COARSE], distance[COARSE])
    return claim(
        "IV, Fig. 5a",
        f"rho* = 0.1 on the grid 0, 0.1, .., 1 with {BATCH} trials, under `{force}`.",
        f"a batch of {BATCH} lines chooses 0.1; so does the mean over all lines",
        chosen,
        Quantity("best range of the grid, all trials", everywhere, digits=1),
        share(f"batches of {BATCH} that choose 0.1", chosen),
        share("single lines whose best range is 0.1", own),
        mean("mean d_ss(0.1)", distance[_FIRST], digits=4),
        mean("mean number of clusters at 0.1", grid["num_components"][_FIRST]),
        in_expectation=everywhere.mean == _GRID[_FIRST],
        trials=distance.shape[1],
        is_reading=force != "linear",
    )


def _second_peak(grid: Arrays) -> Claim:
    distance = grid["escape_distance"]
    best = stats.argmax(_GRID, distance)
    upper = slice(LINE_GRID.index(0.5), None)
    second = stats.argmax(_GRID[upper], distance[upper])
    # Peaks are compared on other lines than those on which the second one is found.
    chosen, reported = distance[:, ::2], distance[:, 1::2]
    peak = reported[upper.start + int(np.argmax(chosen[upper].mean(axis=1)))]
    low = np.argmax(_batches(distance), axis=0) < upper.start
    return claim(
        "IV, Fig. 5a",
        "rho* = 0.1 is the optimal range (`linear`, on a grid of 0.01).",
        f"a batch of {BATCH} lines has its best range below 0.5; that of all lines rounds to 0.1",
        low,
        Quantity("best range", best),
        Quantity("best range above 0.5, a second peak", second),
        mean("mean d_ss at the second peak", peak, digits=4),
        mean("d_ss(0.1) - d_ss(second peak), paired", reported[_FIRST] - peak, digits=4),
        share(f"batches of {BATCH} whose best range is below 0.5", low),
        in_expectation=round(best.mean, 1) == 0.1,
        trials=distance.shape[1],
        is_reading=True,
    )


def _at_best(grid: Arrays) -> list[Claim]:
    distance, components = grid["escape_distance"][_FIRST], grid["num_components"][_FIRST].astype(float)
    rounds = np.round(_batches(distance[np.newaxis])[0], 1) == 0.3
    of_batches = _batches(components[np.newaxis])[0]
    low, high = map(float, np.quantile(of_batches, [0.025, 0.975]))
    few = (components == 2) | (components == 3)
    return [
        claim(
            "IV, Fig. 5a",
            "Mean d_ss(0.1) = 0.3.",
            f"the mean of a batch of {BATCH} lines rounds to 0.3; so does that of all",
            rounds,
            mean("mean d_ss(0.1), `linear`", distance, digits=4),
            share(f"means of {BATCH} that round to 0.3", rounds),
            in_expectation=round(distance.mean(), 1) == 0.3,
            trials=len(distance),
        ),
        claim(
            "IV, Fig. 5b",
            "2.65 clusters on average at rho = 0.1: two or three.",
            f"a line ends in two or three clusters; 2.65 lies in the range of 95 % of the means of {BATCH}",
            few,
            mean("mean number of clusters, `linear`", components),
            Quantity(f"means of {BATCH} lines, 95 % of them", Estimate(float(of_batches.mean()), low, high)),
            share("lines with two or three", few),
            in_expectation=low <= 2.65 <= high,
        ),
    ]


def edge_claim(results: dict[str, Arrays]) -> Claim:
    """Return the row about an attack on the edge of the line; Section VI speaks of the flock's edge."""
    studies = {place: results[f"predator at {place}"] for place in PREDATOR_POSITIONS}
    distance = studies[0.0]["escape_distance"]
    wins = every(distance[-1] >= distance, 0)
    measured, components = [], {}
    for place, study in studies.items():
        best = stats.argmax(_GRID, study["escape_distance"])
        components[place] = study["num_components"][LINE_GRID.index(float(best.mean))]
        measured += [
            Quantity(f"best range, x_p = {place:g}", best),
            mean(f"mean number of clusters at the best range, x_p = {place:g}", components[place]),
        ]
    return claim(
        "VI, for the line",
        "Against a predator at the edge (x_p = 0) full connectivity is best.",
        "no range keeps the predator farther than rho = 1; the best range in expectation leaves one cluster",
        wins,
        share("lines in which rho = 1 is best, x_p = 0", wins),
        *measured,
        in_expectation=(components[0.0] == 1).all(),
        is_reading=True,
    )


def _counts(free: Arrays, rho: float) -> NDArray[np.int64]:
    finals = free["final"][FREE_RANGES.index(rho)]
    counts: NDArray[np.int64] = 1 + (np.diff(finals, axis=1) > rho).sum(axis=1)
    return counts


def _batches(values: FloatArray) -> FloatArray:
    """Return the means over batches of ``BATCH`` lines: shape (k, lines) to (k, batches)."""
    whole = values.shape[1] // BATCH * BATCH
    means: FloatArray = values[:, :whole].reshape(len(values), -1, BATCH).mean(axis=-1)
    return means
