"""The paper's claims about the line (Sections III, IV and VI), measured."""

import numpy as np

from flockesc_env.common.stats import Estimate, FloatArray, argmax
from flockesc_env.jobs import Arrays
from studies.paper import plan
from studies.paper.claims import Claim, Quantity, claim, exactly, mean, share

PRINTED_CLUSTERS = {0.2: (0.35, 0.69), 0.1: (0.14, 0.40, 0.67, 0.88)}  # positions in Figure 3 by range
NEAR = 0.05  # largest distance at which a cluster counts as being where the paper has it
_AT_TENTH = plan.LINE_GRID.index(0.1)  # the paper's best range
_GRID = np.array(plan.LINE_GRID)


def clusters(final: FloatArray, rho: float) -> FloatArray:
    """Return the positions of the clusters of one steady state, given in rising order."""
    parts = np.split(final, np.flatnonzero(np.diff(final) > rho) + 1)
    return np.array([part.mean() for part in parts])


def theory_claims(results: dict[str, Arrays]) -> list[Claim]:
    """Return the rows of Section III, in the paper's order."""
    free, at = results["free line"], plan.FREE_RANGES.index
    # m(t) never falls, so that a line with one cluster was connected at all times.
    connected = np.all(np.diff(free["final"][at(0.3)], axis=1) <= 0.3, axis=1)
    off_mean, off_alpha = free["mean_offset"][at(0.3)][connected], free["alpha_offset"][at(0.2)]
    thresholds = {rho: results[f"threshold {rho}"] for rho in plan.THRESHOLD_RANGES}
    stays_out = {rho: ~study["returns"][0] for rho, study in thresholds.items()}
    return [
        claim(
            "III, Lemma 1",
            "Without predator the number of components m(t) never falls.",
            "it never falls, under any of the ranges 0, 0.1, 0.2, 0.3, 1",
            np.all(~free["falls"], axis=0),
            "lines in which it never falls",
        ),
        claim(
            "III, Theorem 1",
            "Without predator the line converges to a steady state of separate clusters.",
            "a line comes to rest, under all of these ranges",
            np.all(free["converged"], axis=0),
            "lines that converge",
        ),
        claim(
            "III",
            "A line that stays connected converges to the average of x(0).",
            "a connected line ends within 1e-9 of its average; the mean offset is as small",
            off_mean < 1e-9,
            mean("offset from the average, rho = 0.3", off_mean, digits=4),
            exactly("largest offset", off_mean.max(), digits=3),
            in_expectation=off_mean.mean() < 1e-9,
        ),
        claim(
            "III, Definition 1",
            "Cluster i ends at alpha_i, its average at the time t_c of the last split.",
            "all clusters end within 1e-9 of alpha_i; the mean offset is as small",
            off_alpha < 1e-9,
            mean("largest offset from alpha_i, rho = 0.2", off_alpha, digits=4),
            exactly("over all lines", off_alpha.max(), digits=3),
            in_expectation=off_alpha.mean() < 1e-9,
        ),
        claim(
            "III, Theorem 2",
            "With Eq. 8 and s >= s* = rho_p + rho the line converges (rho <= rho_p).",
            "a line comes to rest under all four ranges",
            np.all([study["converged"][0] for study in thresholds.values()], axis=0),
            "lines that converge at s = s*, rho = 0.05, 0.1, 0.15 and 0.2",
        ),
        claim(
            "III, Eq. 10",
            "Proof of Theorem 2: after one step no agent is within the predator's range.",
            "no agent is within rho_p after the first step, under all four ranges",
            np.all(list(stays_out.values()), axis=0),
            *(share(f"lines with no agent in range, rho = {rho:g}", out) for rho, out in stays_out.items()),
        ),
        _existence("III, Remark", "Eq. 9 as printed", results["grid linear_as_printed"]),
        _existence("IV", "Eq. 9 as simulated (`linear`)", results["grid linear"]),
    ]


def _existence(where: str, name: str, grid: Arrays) -> Claim:
    converged = grid["converged"][plan.COARSE]
    worst = int(np.argmin(converged.mean(axis=1)))
    within = np.all(converged[: round(plan.LINE.predator_range * 10) + 1], axis=0)
    return claim(
        where,
        f"With {name} and s = 2 a steady state exists for all of Figure 5, which d_ss needs.",
        "a line comes to rest within 1,000 steps under each of these ranges",
        np.all(converged, axis=0),
        "lines that converge for all of rho = 0, 0.1, .., 1",
        share("lines that converge for rho = 0, 0.1, 0.2 (<= rho_p)", within),
        share(f"lines that converge at the worst, rho = {worst / 10:g}", converged[worst]),
        is_reading=True,
    )


def line_claims(results: dict[str, Arrays]) -> list[Claim]:
    """Return the rows of Section IV, in the paper's order."""
    grids = {force: results[f"grid {force}"] for force in plan.FORCES}
    return [
        *_figure_3(results["free line"]),
        *_figure_4(results["attacked line"]),
        *(_best_range(force, grids[force]) for force in plan.FORCES),
        _second_peak(grids["linear"]["escape_distance"]),
        *_at_best(grids["linear"]),
    ]


def _figure_3(free: Arrays) -> list[Claim]:
    counts = {
        rho: 1 + (np.diff(finals, axis=1) > rho).sum(axis=1)
        for rho, finals in zip(plan.FREE_RANGES, free["final"], strict=True)
    }
    rows = [
        claim(
            "IV, Fig. 3a",
            "rho = 1: one cluster, at the average of x(0).",
            "one cluster within 1e-9 of the average",
            (counts[1.0] == 1) & (free["mean_offset"][plan.FREE_RANGES.index(1.0)] < 1e-9),
            "lines with one cluster at the average",
        ),
        claim(
            "IV, Fig. 3d",
            "rho = 0: 100 independent agents.",
            "100 components",
            counts[0.0] == plan.LINE.num_agents,
            "lines with 100 components",
        ),
    ]
    for panel, (rho, printed) in zip("bc", PRINTED_CLUSTERS.items(), strict=True):
        number, as_many = len(printed), counts[rho] == len(printed)
        finals = free["final"][plan.FREE_RANGES.index(rho)][as_many]
        found = np.array([clusters(final, rho) for final in finals])
        rows += [
            claim(
                f"IV, Fig. 3{panel}",
                f"rho = {rho:g}: {number} clusters.",
                f"{number} clusters; no other number is as frequent",
                as_many,
                f"lines with {number}",
                mean("mean number", counts[rho]),
                in_expectation=np.argmax(np.bincount(counts[rho])) == number,
            ),
            claim(
                f"IV, Fig. 3{panel}",
                f"rho = {rho:g}: clusters at {', '.join(f'{x:.2f}' for x in printed)}.",
                f"lines with this number of clusters: all within {NEAR:g} of those printed; so are the means",
                np.all(np.abs(found - printed) <= NEAR, axis=1),
                f"lines with all within {NEAR:g}",
                *(mean(f"cluster {k + 1}", found[:, k]) for k in range(number)),
                in_expectation=(np.abs(found.mean(axis=0) - printed) <= NEAR).all(),
            ),
        ]
    return rows


def _figure_4(attacked: Arrays) -> list[Claim]:
    distance = np.abs(attacked["final"] - plan.LINE.predator_position).min(axis=-1)
    best = plan.SHOWN_RANGES.index(0.1)
    rows = zip(plan.SHOWN_RANGES, distance, strict=True)
    measured = [mean(f"mean d_ss, rho = {rho:g}", row, digits=3) for rho, row in rows]
    return [
        claim(
            "IV, Fig. 4",
            "Of rho = 1, 0.2, 0.1 and 0, rho = 0.1 keeps the predator farthest.",
            "d_ss(0.1) is the largest of the four; so is its mean",
            np.all(distance[best] >= distance, axis=0),
            "lines in which it does",
            *measured,
            in_expectation=np.argmax(distance.mean(axis=1)) == best,
        ),
        claim(
            "IV, Fig. 4",
            "d_ss(0.1) = 0.3.",
            "d_ss(0.1) rounds to 0.3; so does its mean",
            np.round(distance[best], 1) == 0.3,
            "lines that round to 0.3",
            measured[best],
            in_expectation=round(distance[best].mean(), 1) == 0.3,
        ),
    ]


def _best_range(force: str, grid: Arrays) -> Claim:
    distance = grid["escape_distance"]
    chosen = np.argmax(_batches(distance[plan.COARSE]), axis=0) == 1
    everywhere = argmax(_GRID[plan.COARSE], distance[plan.COARSE])
    return claim(
        "IV, Fig. 5a",
        f"rho* = 0.1 on the grid 0, 0.1, .., 1 with {plan.BATCH} trials, under `{force}`.",
        f"a batch of {plan.BATCH} lines chooses 0.1; so does the mean over all lines",
        chosen,
        Quantity("best range of the grid, all trials", everywhere, digits=1),
        f"batches of {plan.BATCH} that choose 0.1",
        share("single lines whose best range is 0.1", np.argmax(distance[plan.COARSE], axis=0) == 1),
        mean("mean d_ss(0.1)", distance[_AT_TENTH], digits=4),
        mean("mean number of clusters at 0.1", grid["num_components"][_AT_TENTH]),
        in_expectation=everywhere.mean == _GRID[_AT_TENTH],
        trials=distance.shape[1],
        is_reading=force != "linear",
    )


def _second_peak(distance: FloatArray) -> Claim:
    best, upper = argmax(_GRID, distance), plan.LINE_GRID.index(0.5)
    # Peaks are compared on other lines than those on which the second one is found.
    chosen, reported = distance[:, ::2], distance[:, 1::2]
    peak = reported[upper + int(np.argmax(chosen[upper:].mean(axis=1)))]
    return claim(
        "IV, Fig. 5a",
        "rho* = 0.1 is the optimal range (`linear`, on a grid of 0.01).",
        f"a batch of {plan.BATCH} lines has its best range below 0.5; that of all lines rounds to 0.1",
        np.argmax(_batches(distance), axis=0) < upper,
        Quantity("best range", best),
        Quantity("best range above 0.5, a second peak", argmax(_GRID[upper:], distance[upper:])),
        mean("mean d_ss at the second peak", peak, digits=4),
        mean("d_ss(0.1) - d_ss(second peak), paired", reported[_AT_TENTH] - peak, digits=4),
        f"batches of {plan.BATCH} whose best range is below 0.5",
        in_expectation=round(best.mean, 1) == 0.1,
        trials=distance.shape[1],
        is_reading=True,
    )


def _at_best(grid: Arrays) -> list[Claim]:
    distance, components = grid["escape_distance"][_AT_TENTH], grid["num_components"][_AT_TENTH].astype(float)
    of_batches, batch = _batches(components[np.newaxis])[0], plan.BATCH
    low, high = map(float, np.quantile(of_batches, [0.025, 0.975]))
    return [
        claim(
            "IV, Fig. 5a",
            "Mean d_ss(0.1) = 0.3.",
            f"the mean of a batch of {batch} lines rounds to 0.3; so does that of all",
            np.round(_batches(distance[np.newaxis])[0], 1) == 0.3,
            mean("mean d_ss(0.1), `linear`", distance, digits=4),
            f"means of {batch} that round to 0.3",
            in_expectation=round(distance.mean(), 1) == 0.3,
            trials=len(distance),
        ),
        claim(
            "IV, Fig. 5b",
            "2.65 clusters on average at rho = 0.1: two or three.",
            f"a line ends in two or three clusters; 2.65 lies in the range of 95 % of the means of {batch}",
            (components == 2) | (components == 3),
            mean("mean number of clusters, `linear`", components),
            Quantity(f"means of {batch} lines, 95 % of them", Estimate(float(of_batches.mean()), low, high)),
            "lines with two or three",
            in_expectation=low <= 2.65 <= high,
        ),
    ]


def edge_claim(results: dict[str, Arrays]) -> Claim:
    """Return the row about an attack on the edge of the line; Section VI speaks of the flock's edge."""
    measured, components = [], {}
    for place in plan.PREDATOR_POSITIONS:
        study = results[f"predator at {place}"]
        best = argmax(_GRID, study["escape_distance"])
        components[place] = study["num_components"][plan.LINE_GRID.index(float(best.mean))]
        measured += [
            Quantity(f"best range, x_p = {place:g}", best),
            mean(f"mean number of clusters at the best range, x_p = {place:g}", components[place]),
        ]
    distance = results["predator at 0.0"]["escape_distance"]
    return claim(
        "VI, for the line",
        "Against a predator at the edge (x_p = 0) full connectivity is best.",
        "no range keeps the predator farther than rho = 1; the best range in expectation leaves one cluster",
        np.all(distance[-1] >= distance, axis=0),
        "lines in which rho = 1 is best, x_p = 0",
        *measured,
        in_expectation=(components[0.0] == 1).all(),
        is_reading=True,
    )


def _batches(values: FloatArray) -> FloatArray:
    """Return the means over batches of ``BATCH`` lines: shape (k, lines) to (k, batches)."""
    whole = values.shape[1] // plan.BATCH * plan.BATCH
    means: FloatArray = values[:, :whole].reshape(len(values), -1, plan.BATCH).mean(axis=-1)
    return means
