"""The paper's own measurements: curves of flocks and consensus of lines."""

from functools import partial
from typing import Any

import numpy as np

from flockesc_env import FlockScenario, LineScenario, simulate, simulate_line
from flockesc_env.jobs import Arrays
from studies.measurements import over


def curves(scenario: FlockScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return distances and components of flocks at every time 0..T, shape (ranges, seeds, T + 1)."""

    def measure(rho: float, seed: int) -> dict[str, Any]:
        run = simulate(scenario, rho, seed=seed)
        return {name: getattr(run, name) for name in ("mean_distance", "min_distance", "num_components")}

    return over(measure, ranges, seeds)


def consensus(scenario: LineScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return the quantities of the theorems for every line.

    - ``final``: x_ss in rising order, with a last axis over agents;
    - ``mean_offset``: |mean of x_ss - mean of x(0)|;
    - ``alpha_offset``: largest |alpha_i - limit| over clusters, with alpha_i of Definition 1;
    - ``falls``: whether m(t) ever falls;
    - ``returns``: whether an agent is within the predator's range after the first step;
    - ``converged``.
    """
    return over(partial(_consensus_of, scenario), ranges, seeds)


def _consensus_of(scenario: LineScenario, rho: float, seed: int) -> dict[str, Any]:
    run = simulate_line(scenario, rho, seed=seed)
    components, last = run.num_components, run.states[-1]
    at_split = run.states[np.argmax(components == components[-1])]  # at t_c of Eq. 4
    order = np.argsort(last, kind="stable")
    clusters = np.split(order, np.flatnonzero(np.diff(last[order]) > rho) + 1)
    target, reach = scenario.predator_position, scenario.predator_range
    return {
        "final": last[order],
        "mean_offset": abs(last.mean() - run.states[0].mean()),
        "alpha_offset": max(abs(at_split[who].mean() - last[who].mean()) for who in clusters),
        "falls": bool((np.diff(components) < 0).any()),
        "returns": target is not None and bool((np.abs(run.states[1:] - target) < reach).any()),
        "converged": run.converged,
    }
