"""Studies in chunks of runs: pure functions of scenario, ranges and seeds, and files of their results."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.files import atomic_write
from flockesc_env.envs.vector import FlockVectorEnv
from flockesc_env.models.simulate import simulate_line
from flockesc_env.models.sweep import FlockSweepResult, LineSweepResult, Progress, sweep
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

Arrays = dict[str, NDArray[Any]]
"""Results by name, of shape (ranges, seeds) or (ranges, seeds, times)."""


def objectives(scenario: FlockScenario | LineScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return the objectives and the final components of every run."""
    result = sweep(scenario, ranges, seeds)
    shared = {"num_components": result.num_components}
    if isinstance(result, LineSweepResult):
        return shared | {"escape_distance": result.escape_distance, "converged": result.converged}
    assert isinstance(result, FlockSweepResult)  # noqa: S101, there are two models
    return shared | {
        "min_mean_distance": result.min_mean_distance,
        "min_min_distance": result.min_min_distance,
    }


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
    """Return what the theorems speak of, for every line.

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


KINDS: dict[str, Callable[..., Arrays]] = {
    "objectives": objectives,
    "curves": curves,
    "consensus": consensus,
}


@cache
def _engine() -> str:
    """Return a hash of the compiled core: another build may compute other bits."""
    core = find_spec("flockesc_env._core")
    assert core is not None  # noqa: S101, the package does not import without it
    assert core.origin is not None  # noqa: S101, it is a file
    with Path(core.origin).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True)
class Job:
    """One chunk of runs, which can be computed alone.

    Attributes:
        kind: a name of ``KINDS``.
        scenario: the model's parameters.
        ranges: rho of every row.
        seeds: the flocks or lines.
    """

    kind: str
    scenario: FlockScenario | LineScenario
    ranges: tuple[float, ...]
    seeds: range

    @property
    def size(self) -> int:
        """Return about how long the chunk takes, in runs of a line."""
        steps = self.scenario.num_steps if isinstance(self.scenario, FlockScenario) else 1
        return len(self.ranges) * len(self.seeds) * steps

    def key(self) -> str:
        """Return a hash of everything that the results depend on."""
        parts = {
            "kind": self.kind,
            "model": type(self.scenario).__name__,
            "scenario": json.loads(self.scenario.to_json()),
            "ranges": self.ranges,
            "seeds": [self.seeds.start, self.seeds.stop],
            "engine": _engine(),
        }
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    def run(self) -> Arrays:
        """Compute the chunk."""
        return KINDS[self.kind](self.scenario, self.ranges, self.seeds)


class Cache:
    """Results of jobs in a folder, one file each, named by the hash of what they depend on.

    Args:
        folder: where; made when the first result is kept.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def get(self, job: Job) -> Arrays:
        """Return the results of a job: from its file, or computed and then kept."""
        path = self._path(job)
        if not path.exists():
            results = job.run()
            self.folder.mkdir(parents=True, exist_ok=True)
            with atomic_write(path) as file:
                np.savez_compressed(file, allow_pickle=False, **results)
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}

    def _path(self, job: Job) -> Path:
        return self.folder / f"{job.key()}.npz"


@dataclass(frozen=True)
class Study:
    """Runs of one scenario: seed 0 and following under every range."""

    kind: str
    scenario: FlockScenario | LineScenario
    ranges: tuple[float, ...]
    num_seeds: int

    def jobs(self) -> list[Job]:
        """Cut the study into jobs of at most some seconds."""
        size = 50 if isinstance(self.scenario, FlockScenario) else 1_000
        starts = range(0, self.num_seeds, size)
        chunks = [range(start, min(start + size, self.num_seeds)) for start in starts]
        return [Job(self.kind, self.scenario, self.ranges, chunk) for chunk in chunks]


def total_size(studies: Mapping[str, Study]) -> int:
    """Return the size of all jobs together, in units of ``Job.size``."""
    return sum(job.size for study in studies.values() for job in study.jobs())


def measure(studies: Mapping[str, Study], cache: Cache, progress: Progress) -> dict[str, Arrays]:
    """Do all jobs that the cache lacks, and return every study's results.

    Args:
        studies: by name.
        cache: where results are kept; what is in it already is not computed again.
        progress: called with the size of what is finished and of the whole.
    """
    total, finished = total_size(studies), 0
    results = {}
    for name, study in studies.items():
        parts = []
        for job in study.jobs():
            progress(finished, total)
            parts.append(cache.get(job))
            finished += job.size
        results[name] = {key: np.concatenate([part[key] for part in parts], axis=1) for key in parts[0]}
    progress(finished, total)
    return results
