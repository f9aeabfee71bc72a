"""Young et al. 2013: the number of neighbors with the most robust consensus per neighbor.

Young, Scardovi, Cavagna, Giardina and Leonard, "Starling flock networks manage uncertainty in consensus at
low cost" (2013); the norm is from Young, Scardovi and Leonard, "Robustness of noisy consensus dynamics with
directed communication" (2010).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.linalg import null_space, solve_continuous_lyapunov
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flockesc_env import FlockScenario, Topological, neighbor_pairs
from flockesc_env.benchmark.seeds import HELD_OUT, first_seeds
from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from studies.measurements import chunks
from studies.style import curve, letter
from studies.validation.results import Verdict, scaled
from training.figure_style import WIDTH, label_ends

TITLE: Final = "Robust consensus per neighbor"
PUBLISHED: Final = (
    "best at 6 to 7 neighbors; depends on the flock's thickness, not on its size"
    " ([Young et al. 2013](https://doi.org/10.1371/journal.pcbi.1002894))"
)
LOWEST, HIGHEST = 6, 7
"""The published best number of neighbors."""

SAME: Final = 1.0
"""Bound of a change of the best number of neighbors that counts as none."""

NEIGHBORS: Final = tuple(range(2, 21))
WIDTH_RATIO: Final = 0.5
"""Middle side of the box over its longest side."""

THICKNESSES: Final = (0.05, 0.1, 0.18, 0.3, 0.5)
"""Shortest side of the box over its longest side."""

STARLINGS: Final = 0.18
"""Thickness of a starling flock: the sides are as 1 : 2.8 : 5.6 (Ballerini et al. 2008, Animal Behaviour)."""

SIZES: Final = {300: 16, 600: 8, 1_200: 4}
"""Flocks by their number of agents."""

FEW: Final = 300
"""Agents of the flocks of different thickness."""

SPACING: Final = 0.6
"""Least distance in the control, in units of the cube root of the volume per agent."""

WEIGHTS: Final = {"1 / k": -1.5, "1": -1.0}
"""Power of k, by the weight of a neighbor, that turns robustness at weight 1 into robustness per neighbor."""


@dataclass(frozen=True)
class Optimum:
    """The best number of neighbors with one kind of weights: means over flocks of each flock's best k.

    ``thickness`` and ``size`` follow ``THICKNESSES`` and ``SIZES``; the changes are paired, the last entry
    minus the first one. ``spaced`` is the control. ``curve`` is the robustness per neighbor by ``NEIGHBORS``.
    """

    thickness: tuple[Estimate, ...]
    thickness_change: Estimate
    size: tuple[Estimate, ...]
    size_change: Estimate
    spaced: Estimate
    curve: tuple[Estimate, ...]

    @property
    def starlings(self) -> Estimate:
        """The best number at the thickness of starling flocks."""
        return self.thickness[THICKNESSES.index(STARLINGS)]

    @property
    def verdict(self) -> Verdict:
        """The verdict by the rule on the page: that of its three claims together."""
        best, thickness, size = self.starlings, self.thickness_change, self.size_change
        lowest, highest = LOWEST - 0.5, HIGHEST + 0.5  # what rounds to a published number
        if best.high < lowest or best.low > highest or size.low > 0 or size.high < 0:
            return Verdict.DIFFERS
        is_shown = (
            lowest <= best.low <= best.high <= highest
            and (thickness.low > 0 or thickness.high < 0)
            and -SAME < size.low <= size.high < SAME
        )
        return Verdict.AGREES if is_shown else Verdict.OPEN


@dataclass(frozen=True)
class RobustConsensus:
    """Optima by the weight of a neighbor; ``num_flocks`` follows ``SIZES``."""

    optima: dict[str, Optimum]
    num_flocks: tuple[int, ...]


def squared_norm(pairs: NDArray[np.int64], num_agents: int) -> float:
    """Return the squared H2 norm of x' = -L x + white noise, y: x without its mean; L has unit weights.

    It is infinite unless one agent, directly or by others, is heard by everybody.
    """
    ones = np.ones(len(pairs))
    graph = coo_array((ones, tuple(pairs.T)), shape=(num_agents, num_agents)).tocsr()
    components, labels = connected_components(graph, connection="strong")
    listener, speaker = labels[pairs].T
    if components - len(np.unique(listener[listener != speaker])) > 1:  # components that hear nobody else
        return np.inf
    laplacian = np.diag(graph.sum(axis=1)) - graph.toarray()
    basis = null_space(np.ones((1, num_agents)))
    return float(np.trace(solve_continuous_lyapunov(basis.T @ laplacian @ basis, np.eye(num_agents - 1))))


def points(seed: int, num_agents: int, thickness: float, spacing: float) -> FloatArray:
    """Return uniform random points in a box, at least ``spacing`` apart, shape (n, 3)."""
    rng = np.random.default_rng(seed)
    sides = np.array([thickness, WIDTH_RATIO, 1.0])
    least = spacing * (sides.prod() / num_agents) ** (1 / 3)
    placed = np.empty((num_agents, 3))
    count = 0
    while count < num_agents:
        placed[count] = rng.random(3) * sides
        count += bool((np.linalg.norm(placed[:count] - placed[count], axis=1) >= least).all())
    return placed


def robustness(num_agents: int, thickness: float, spacing: float, seeds: range) -> Arrays:
    """Return sqrt(n) / H2 at weight 1, shape (k, seeds)."""
    scenario = FlockScenario(neighbor_rule=Topological(), dimension=3)
    norms = [
        [squared_norm(neighbor_pairs(scenario, placed, k), num_agents) for k in NEIGHBORS]
        for placed in (points(seed, num_agents, thickness, spacing) for seed in seeds)
    ]
    return {"robustness": np.sqrt(num_agents / np.array(norms).T)}


def jobs(scale: float) -> dict[str, list[Job]]:
    """Return the jobs by flock, for ``results``."""
    flocks = {f"thickness {thickness}": (FEW, thickness, 0.0) for thickness in THICKNESSES}
    flocks |= {f"size {size}": (size, STARLINGS, 0.0) for size in SIZES}
    flocks["spaced"] = (FEW, STARLINGS, SPACING)
    call = f"{__name__}:robustness"
    return {
        name: [
            Job(call, (size, thickness, spacing, seeds), len(seeds) * (size / 400) ** 3)
            for seeds in chunks(first_seeds(HELD_OUT, scaled(SIZES[size], scale)), 2)
        ]
        for name, (size, thickness, spacing) in flocks.items()
    }


def results(measured: Mapping[str, Arrays]) -> RobustConsensus:
    """Return the results of the jobs of ``jobs``."""
    values = {name: found["robustness"] for name, found in measured.items()}
    return RobustConsensus(
        optima={weights: _optimum(values, power) for weights, power in WEIGHTS.items()},
        num_flocks=tuple(values[f"size {size}"].shape[1] for size in SIZES),
    )


def _optimum(values: Mapping[str, FloatArray], power: float) -> Optimum:
    neighbors = np.array(NEIGHBORS, float)
    per_neighbor = {name: found * neighbors[:, None] ** power for name, found in values.items()}
    best = {name: neighbors[found.argmax(axis=0)] for name, found in per_neighbor.items()}
    thickness = [best[f"thickness {each}"] for each in THICKNESSES]
    size = [best[f"size {each}"] for each in SIZES]
    return Optimum(
        thickness=tuple(stats.mean(found) for found in thickness),
        thickness_change=stats.mean(thickness[-1] - thickness[0]),
        size=tuple(stats.mean(found) for found in size),
        size_change=stats.mean(size[-1] - size[0][: len(size[-1])]),
        spaced=stats.mean(best["spaced"]),
        curve=tuple(stats.mean(row) for row in per_neighbor[f"thickness {STARLINGS}"]),
    )


def here(results: RobustConsensus) -> str:
    """Return the best numbers of neighbors at the thickness of starling flocks."""
    found = [
        f"{optimum.starlings:.1f} neighbors of weight {name}" for name, optimum in results.optima.items()
    ]
    return f"best at {' and '.join(found)}, for random points"


def verdict(results: RobustConsensus) -> Verdict:
    """Return the verdict of both weights if it is the same."""
    verdicts = {optimum.verdict for optimum in results.optima.values()}
    return verdicts.pop() if len(verdicts) == 1 else Verdict.OPEN


def figure(results: RobustConsensus) -> Figure:
    """Draw the robustness per neighbor, and the best k by thickness and size; a band is the published one."""
    drawn = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    panels = drawn.subplots(1, 3)
    ends = []
    for color, (weights, optimum) in zip(LIGHT.others, results.optima.items(), strict=False):
        highest = max(row.mean for row in optimum.curve)
        relative = [Estimate(e.mean / highest, e.low / highest, e.high / highest) for e in optimum.curve]
        curve(panels[0], NEIGHBORS, relative, color, band=0.15, lw=1.8)
        curve(panels[1], THICKNESSES, optimum.thickness, color, "o-", band=0.15, lw=1.8, ms=4)
        curve(panels[2], tuple(SIZES), optimum.size, color, "o-", band=0.15, lw=1.8, ms=4)
        ends.append((optimum.size[-1].mean, f"weight {weights}", color))
    panels[0].axvspan(LOWEST, HIGHEST, color=LIGHT.grid, lw=0, zorder=0)
    for axes in panels[1:]:
        axes.axhspan(LOWEST, HIGHEST, color=LIGHT.grid, lw=0, zorder=0)
        axes.set_ylabel("best number of neighbors")
    panels[0].set(xlabel="number of neighbors k", ylabel="robustness per neighbor (largest = 1)")
    panels[1].set(xlabel="thickness", xscale="log")
    panels[2].set(xlabel="number of agents", xscale="log")
    panels[1].set_xticks(THICKNESSES, [f"{each:g}" for each in THICKNESSES], minor=False)
    panels[2].set_xticks(tuple(SIZES), [f"{each:,}" for each in SIZES], minor=False)
    for axes in panels[1:]:
        axes.minorticks_off()
    label_ends(panels[2], ends)
    for index, (axes, title) in enumerate(
        zip(panels, ("starlings' thickness", "thickness", "size"), strict=True)
    ):
        letter(axes, index, title)
    return drawn
