"""Sweeps as jobs: consecutive seeds of one scenario, every range on the same initial states."""

from collections.abc import Sequence

import numpy as np

from flockesc_env.jobs.job import Arrays, Job
from flockesc_env.models.sweep import sweep
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

OUTCOMES = "flockesc_env.jobs.sweeps:outcomes"

_AGENT_STEP = 30e-9
_LINE = 10e-6
"""Estimated seconds of a step of one agent under the metric rule, and of a line."""


def outcomes(scenario: FlockScenario | LineScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return the outcomes of every run by their names in ``SweepResult``, shape (ranges, seeds)."""
    inputs = {"scenario", "interaction_ranges", "seeds"}
    found = vars(sweep(scenario, ranges, seeds))
    return {name: values for name, values in found.items() if name not in inputs}


def seed_jobs(
    function: str, scenario: FlockScenario | LineScenario, ranges: tuple[float, ...], seeds: range
) -> list[Job]:
    """Return the jobs of a function of scenario, ranges and seeds: some seconds each."""
    size, run = 1_000, _LINE
    if isinstance(scenario, FlockScenario):
        size, run = 50, scenario.num_steps * scenario.num_agents * _AGENT_STEP
    chunks = [seeds[start : start + size] for start in range(0, len(seeds), size)]
    return [Job(function, (scenario, ranges, chunk), run * len(ranges) * len(chunk)) for chunk in chunks]


def joined(parts: Sequence[Arrays]) -> Arrays:
    """Return the results of consecutive seeds as those of one job; seeds are the second or the only axis."""
    if len(parts) == 1:
        return parts[0]
    axes = {name: min(1, values.ndim - 1) for name, values in parts[0].items()}
    return {name: np.concatenate([part[name] for part in parts], axis) for name, axis in axes.items()}
