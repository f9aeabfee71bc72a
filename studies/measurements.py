"""Measurements as jobs: runs of fixed ranges and policies on many seeds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from flockesc_env import FlockScenario, LineScenario
from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from flockesc_env.jobs.sweeps import seed_jobs

Key = TypeVar("Key")


@dataclass(frozen=True)
class Measurement:
    """Runs of one scenario on seeds from 0 on, by a function of scenario, ranges and seeds."""

    function: str
    scenario: FlockScenario | LineScenario
    ranges: tuple[float, ...]
    num_seeds: int

    def jobs(self) -> list[Job]:
        """Cut the measurement into jobs of some seconds."""
        return seed_jobs(self.function, self.scenario, self.ranges, range(self.num_seeds))


@dataclass(frozen=True)
class Runner:
    """Runs jobs on a back end; a job whose result is in the cache is not computed again."""

    cache: Cache
    backend: Backend
    progress: bool = False

    def each(self, jobs: Mapping[Key, Job], title: str) -> dict[Key, Arrays]:
        """Run a job per key, and return the results."""
        found = run(list(jobs.values()), self.cache, self.backend, title=title, progress=self.progress)
        return dict(zip(jobs, found, strict=True))

    def groups(self, jobs: Mapping[Key, Sequence[Job]], title: str) -> dict[Key, Arrays]:
        """Run the jobs of all groups; jobs of a group differ in their seeds, and their results are joined."""
        parts = {(key, at): job for key, group in jobs.items() for at, job in enumerate(group)}
        found = self.each(parts, title)
        return {key: _joined([found[key, at] for at in range(len(group))]) for key, group in jobs.items()}

    def measure(self, measurements: Mapping[str, Measurement]) -> dict[str, Arrays]:
        """Return the results of every measurement."""
        jobs = {name: measurement.jobs() for name, measurement in measurements.items()}
        return self.groups(jobs, "Measuring")


def chunks(flocks: range, size: int) -> list[range]:
    """Cut a range of seeds into parts of at most ``size``."""
    return [flocks[start : start + size] for start in range(0, len(flocks), size)]


def means(rows: Iterable[FloatArray]) -> tuple[Estimate, ...]:
    """Return the mean of every row with its interval."""
    return tuple(map(stats.mean, rows))


def _joined(parts: Sequence[Arrays]) -> Arrays:
    """Join the axes of seeds: the second ones, or the only ones of arrays with one axis."""
    return {
        name: np.concatenate([part[name] for part in parts], axis=min(1, values.ndim - 1))
        for name, values in parts[0].items()
    }
