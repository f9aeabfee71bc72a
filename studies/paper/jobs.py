"""The paper's own measurements: curves over time of flocks, and the consensus of lines."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from flockesc_env import FlockScenario, FlockVectorEnv, LineScenario, simulate_line
from flockesc_env.jobs import Arrays

CURVES: Final = "studies.paper.jobs:curves"
CONSENSUS: Final = "studies.paper.jobs:consensus"


def curves(scenario: FlockScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return distances and components of flocks at every time 0..T; at t = 0 every agent is alone."""
    names = ("mean_distance", "min_distance", "num_components")
    found: dict[str, list[NDArray[Any]]] = {name: [] for name in names}
    for rho in ranges:
        # Ranges that float32 hits, as those of the figures are, come out of the action exactly.
        env = FlockVectorEnv(
            len(seeds), scenario, action_mode="range", max_range=max(ranges), count_components=True
        )
        _, infos = env.reset(seed=list(seeds))
        actions = np.full((len(seeds), 1), rho, np.float32)
        rows = [infos, *(env.step(actions)[-1] for _ in range(scenario.num_steps))]
        for name in names:
            found[name].append(np.stack([row[name] for row in rows], axis=-1))
    return {name: np.array(parts) for name, parts in found.items()}


def consensus(scenario: LineScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return the quantities of the theorems for every line.

    - ``final``: x_ss in rising order, with a last axis over agents;
    - ``mean_offset``: |mean of x_ss - mean of x(0)|;
    - ``alpha_offset``: largest |alpha_i - limit| over clusters, with alpha_i of Definition 1;
    - ``falls``: whether m(t) ever falls;
    - ``returns``: whether an agent is within the predator's range after the first step;
    - ``converged``.
    """
    rows = [[_consensus_of(scenario, rho, seed) for seed in seeds] for rho in ranges]
    return {name: np.array([[line[name] for line in row] for row in rows]) for name in rows[0][0]}


def _consensus_of(scenario: LineScenario, rho: float, seed: int) -> dict[str, Any]:
    run = simulate_line(scenario, rho, seed=seed)
    components, last = run.num_components, run.states[-1]
    split = int(np.argmax(components == components[-1]))  # t_c of Eq. 4
    order = np.argsort(last, kind="stable")
    clusters = np.split(order, np.flatnonzero(np.diff(last[order]) > rho) + 1)
    target, reach = scenario.predator_position, scenario.predator_range
    return {
        "final": last[order],
        "mean_offset": abs(last.mean() - run.states[0].mean()),
        "alpha_offset": max(abs(run.states[split][who].mean() - last[who].mean()) for who in clusters),
        "falls": bool((np.diff(components) < 0).any()),
        "returns": target is not None and bool((np.abs(run.states[1:] - target) < reach).any()),
        "converged": run.converged,
    }
