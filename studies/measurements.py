"""Measurements: jobs and their results, policies on flocks as jobs, and columns of tables by flock."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import polars as pl

from flockesc_env import FlockScenario, LineScenario, rollout
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.episodes.splits import first_seeds
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from flockesc_env.jobs.sweeps import joined
from flockesc_env.policies import BasePolicy, load_policy
from flockesc_env.policies.registry import parse_policy

Key = TypeVar("Key")

_AGENT_STEP = 200e-9  # estimated seconds of a step of one agent under a policy


@dataclass(frozen=True)
class Runner:
    """Runs jobs on a back end; a job whose result is in the cache is not computed again."""

    cache: Cache
    backend: Backend

    def run(self, jobs: Mapping[Key, Job | Sequence[Job]], title: str) -> dict[Key, Arrays]:
        """Run the jobs of every key; several of them differ in their seeds, and their results are joined."""
        groups = {key: [group] if isinstance(group, Job) else group for key, group in jobs.items()}
        every = [job for group in groups.values() for job in group]
        found = iter(run(every, self.cache, self.backend, title=title))
        return {key: joined([*islice(found, len(group))]) for key, group in groups.items()}

    def join(self, jobs: Sequence[Job], title: str) -> Arrays:
        """Run jobs that differ in their seeds, and return their joined results."""
        return self.run({None: jobs}, title)[None]


def share_of(purpose: range, count: int, scale: float, *, least: int = 2) -> range:
    """Return the first seeds of a purpose: a share of their number, at least ``least``."""
    return first_seeds(purpose, max(least, round(count * scale)))


def split(
    function: Callable[..., Arrays], *arguments: Any, flocks: range, size: int, seconds: float
) -> list[Job]:
    """Return jobs that call ``function(*arguments, part)`` with parts of at most ``size`` flocks.

    A flock takes about ``seconds``.
    """
    name = f"{function.__module__}:{function.__name__}"
    parts = [flocks[start : start + size] for start in range(0, len(flocks), size)]
    return [Job(name, (*arguments, part), seconds * len(part)) for part in parts]


def over(measure: Callable[[float, int], Mapping[str, Any]], ranges: Iterable[float], seeds: range) -> Arrays:
    """Return numbers or arrays by name with axes (ranges, seeds, ..) from those of a range and a seed."""
    return by_name([by_name([measure(rho, seed) for seed in seeds]) for rho in ranges])


def by_name(runs: Sequence[Mapping[str, Any]]) -> Arrays:
    """Return the numbers or arrays of several runs by name, with a first axis over the runs."""
    return {name: np.array([run[name] for run in runs]) for name in runs[0]}


def means(rows: Iterable[FloatArray]) -> tuple[Estimate, ...]:
    """Return the mean of every row with its interval."""
    return tuple(map(mean, rows))


def sign(estimate: Estimate) -> int:
    """Return 1 or -1 if the interval lies above or below 0, and 0 if it contains 0."""
    return int(estimate.low > 0) - int(estimate.high < 0)


def policy_of(policy: str | bytes) -> BasePolicy:
    """Return a built-in policy, or the one in the bytes of a policy file."""
    return load_policy(policy) if isinstance(policy, str) else parse_policy(policy, Path("policy.npz"))


def play(
    policy: str | bytes,
    scenario: FlockScenario | LineScenario,
    column: str,
    options: Mapping[str, Any],
    flocks: range,
) -> Arrays:
    """Return an objective of every flock; ``options`` replace some of those that the policy was made for."""
    return {
        "objective": getattr(rollout(scenario, policy_of(policy).with_options(**options), flocks), column)
    }


def play_jobs(
    policy: str | bytes, scenario: FlockScenario | LineScenario, column: str, flocks: range, **options: Any
) -> list[Job]:
    """Return the jobs of ``play``."""
    steps, slowness = 100, 1
    if isinstance(scenario, FlockScenario):
        steps, slowness = scenario.num_steps, 30 if scenario.neighbor_rule.kind == "topological" else 1
    seconds = steps * scenario.num_agents * _AGENT_STEP * slowness
    return split(play, policy, scenario, column, options, flocks=flocks, size=250, seconds=seconds)


def write_rows(file: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write a table of flocks: a mapping has arrays over the same seeds by column, or their common value."""
    write_table(pl.concat(pl.DataFrame(row) for row in rows), file)


def values_by(table: pl.DataFrame, *keys: str, column: str = "objective") -> dict[Any, FloatArray]:
    """Return a column, flocks in rising order, by the values of several other columns."""
    groups = table.group_by(*keys, maintain_order=True)
    return {key: part.sort("seed")[column].to_numpy() for key, part in groups}
