"""Measurements of fixed ranges on many seeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flockesc_env import FlockScenario, LineScenario
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from flockesc_env.jobs.sweeps import joined, seed_jobs


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
        """Cut the measurement into jobs of some seconds."""
        return seed_jobs(self.function, self.scenario, self.ranges, range(self.num_seeds))


def measure(
    measurements: Mapping[str, Measurement], cache: Cache, backend: Backend, *, progress: bool = False
) -> dict[str, Arrays]:
    """Run all jobs that the cache lacks, and return the results of every measurement.

    Args:
        measurements: by name.
        cache: keeps the results of jobs; a job in it is not computed again.
        backend: where jobs run.
        progress: whether to show the progress bar even if stderr is not a terminal.

    Raises:
        JobError: if jobs failed.
    """
    jobs = {name: measurement.jobs() for name, measurement in measurements.items()}
    return run_groups(jobs, cache, backend, title="Measuring", progress=progress)


def run_groups(
    jobs: Mapping[str, list[Job]], cache: Cache, backend: Backend, *, title: str, progress: bool = False
) -> dict[str, Arrays]:
    """Run the jobs of all groups; the jobs of a group differ in their seeds, and their results are joined."""
    every = [job for group in jobs.values() for job in group]
    results = iter(run(every, cache, backend, title=title, progress=progress))
    return {name: joined([next(results) for _ in group]) for name, group in jobs.items()}
