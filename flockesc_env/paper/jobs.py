"""Chunks of runs: pure functions of a scenario, ranges and seeds, and the files that keep their results."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env._atomic import writing
from flockesc_env._core import __version__
from flockesc_env.envs.vector import FlockVectorEnv
from flockesc_env.scenario import FlockScenario, LineScenario
from flockesc_env.simulate import simulate_line
from flockesc_env.sweep import FlockSweepResult, LineSweepResult, sweep

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
    """Return distances and components of flocks at every time 0..T; components under the range, from t = dt on."""
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

    ``mean_offset``: |mean of x_ss - mean of x(0)|; ``alpha_offset``: the largest |alpha_i - limit| over clusters, with
    alpha_i of Definition 1; ``num_clusters``; ``falls``: whether m(t) ever falls; ``returns``: steps after the first one
    at which any agent is still within the predator's range.
    """
    found: dict[str, list[list[float]]] = {
        name: [] for name in ("mean_offset", "alpha_offset", "num_clusters", "falls", "returns", "converged")
    }
    for rho in ranges:
        rows = [_consensus_of(scenario, rho, seed) for seed in seeds]
        for name, column in zip(found, zip(*rows, strict=True), strict=True):
            found[name].append(list(column))
    return {name: np.array(parts) for name, parts in found.items()}


def _consensus_of(scenario: LineScenario, rho: float, seed: int) -> tuple[float, ...]:
    run = simulate_line(scenario, rho, seed=seed)
    components, last = run.num_components, run.states[-1]
    split = int(np.argmax(components == components[-1]))  # t_c of Eq. 4
    order = np.argsort(last, kind="stable")
    borders = np.flatnonzero(np.diff(last[order]) > rho) + 1
    clusters = np.split(order, borders)
    alpha = max(abs(run.states[split][who].mean() - last[who].mean()) for who in clusters)
    in_range = np.zeros(0)
    if scenario.predator_position is not None:
        offsets = np.abs(run.states[1:] - scenario.predator_position)
        in_range = (offsets < scenario.predator_range).any(axis=1)
    falls = bool((np.diff(components) < 0).any())
    offset = abs(last.mean() - run.states[0].mean())
    return offset, alpha, len(clusters), falls, float(in_range.sum()), run.converged


KINDS: dict[str, Callable[..., Arrays]] = {
    "objectives": objectives,
    "curves": curves,
    "consensus": consensus,
}


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
    def num_runs(self) -> int:
        """Return the number of runs in the chunk."""
        return len(self.ranges) * len(self.seeds)

    def key(self) -> str:
        """Return a hash of everything that the results depend on."""
        parts = {
            "kind": self.kind,
            "model": type(self.scenario).__name__,
            "scenario": json.loads(self.scenario.to_json()),
            "ranges": self.ranges,
            "seeds": [self.seeds.start, self.seeds.stop],
            "version": __version__,
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

    def has(self, job: Job) -> bool:
        """Return whether the job has been done."""
        return self._path(job).exists()

    def get(self, job: Job) -> Arrays:
        """Return the results of a job: from its file, or computed and then kept."""
        path = self._path(job)
        if not path.exists():
            results = job.run()
            self.folder.mkdir(parents=True, exist_ok=True)
            with writing(path) as file:
                np.savez_compressed(file, **results)
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}

    def _path(self, job: Job) -> Path:
        return self.folder / f"{job.key()}.npz"
