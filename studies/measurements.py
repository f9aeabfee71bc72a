"""Measurements of fixed ranges on many seeds, cut into jobs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flockesc_env import FlockScenario, LineScenario, LineSweepResult, sweep
from flockesc_env.jobs import Arrays, Cache, Job
from flockesc_env.models.sweep import Progress

OBJECTIVES = "studies.measurements:objectives"


def objectives(scenario: FlockScenario | LineScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return the objectives and the final components of every run, shape (ranges, seeds)."""
    result = sweep(scenario, ranges, seeds)
    shared = {"num_components": result.num_components}
    if isinstance(result, LineSweepResult):
        return shared | {"escape_distance": result.escape_distance, "converged": result.converged}
    return shared | {
        "min_mean_distance": result.min_mean_distance,
        "min_min_distance": result.min_min_distance,
    }


def measure_job(
    function: str, scenario: FlockScenario | LineScenario, ranges: tuple[float, ...], seeds: range
) -> Job:
    """Return the job of some runs; its size is about that of as many runs of a line."""
    steps = scenario.num_steps if isinstance(scenario, FlockScenario) else 1
    return Job(function, (scenario, ranges, seeds), len(ranges) * len(seeds) * steps)


@dataclass(frozen=True)
class Measurement:
    """Runs of one scenario: seeds from 0 on under every range.

    Attributes:
        function: of ``Job``; it takes a scenario, ranges and seeds.
        scenario: the model's parameters.
        ranges: rho of every row.
        num_seeds: number of flocks or lines.
    """

    function: str
    scenario: FlockScenario | LineScenario
    ranges: tuple[float, ...]
    num_seeds: int

    def jobs(self) -> list[Job]:
        """Cut the measurement into jobs of at most some seconds."""
        size = 50 if isinstance(self.scenario, FlockScenario) else 1_000
        starts = range(0, self.num_seeds, size)
        chunks = [range(start, min(start + size, self.num_seeds)) for start in starts]
        return [measure_job(self.function, self.scenario, self.ranges, chunk) for chunk in chunks]


def total_size(measurements: Mapping[str, Measurement]) -> int:
    """Return the size of all jobs together."""
    return sum(job.size for measurement in measurements.values() for job in measurement.jobs())


def measure(measurements: Mapping[str, Measurement], cache: Cache, progress: Progress) -> dict[str, Arrays]:
    """Do all jobs that the cache lacks, and return the results of every measurement.

    Args:
        measurements: by name.
        cache: keeps the results of jobs; a job in it is not computed again.
        progress: called with the size of the finished jobs and of all jobs.
    """
    total, finished = total_size(measurements), 0
    results = {}
    for name, measurement in measurements.items():
        parts = []
        for job in measurement.jobs():
            progress(finished, total)
            parts.append(cache.get(job))
            finished += job.size
        results[name] = {key: np.concatenate([part[key] for part in parts], axis=1) for key in parts[0]}
    progress(finished, total)
    return results
