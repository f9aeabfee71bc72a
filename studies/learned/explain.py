"""Ablation and transfer of a learned policy: hidden entries of its observation, other scenarios."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from flockesc_env import (
    FixedRange,
    FlockScenario,
    NamedPolicy,
    NetworkPolicy,
    Policy,
    PolicySpec,
    preset,
    rollout,
)
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.spaces import ObservationLayout
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
from studies.learned.held_out import stored_policy
from studies.measurements import run_groups
from training import seeds
from training.config import Setting
from training.evaluation import OUTCOMES, outcome

Observations = NDArray[np.float32]

GROUPS: dict[str, tuple[str, ...]] = {
    "time": ("time",),
    "running minimum": ("running_minimum",),
    "last range": ("last_range",),
    "number of neighbors": ("neighbor_count",),
    "heard velocity": ("heard_velocity",),
    "predator distance": ("predator_distance", "mean_distance", "min_distance", "centroid_distance"),
    "predator direction": ("predator_direction", "heading_away", "velocity_away"),
    "predator velocity": ("predator_velocity", "predator_speed", "predator_aim"),
}
"""Entries of an observation that are hidden together, by the beginnings of their names."""

SIZES = (100, 1_000, 10_000)
WORLDS = ("edge-attack", "pursuit", "intercept", "wandering", "two-predators", "assigned-pair", "clusters")
"""Presets in which the policy was not trained."""

_FLOCK_SECONDS = 0.05
"""Estimated time of an episode of 300 agents under a policy."""


@dataclass
class Watching:
    """A policy that records the observations and ranges of another one.

    Attributes:
        policy: the other policy.
        layouts: layout of its observations, one per action.
        seen: its observations, one array per action.
        ranges: its ranges in m.
    """

    policy: Policy

    def __post_init__(self) -> None:
        self.layouts: list[ObservationLayout] = []
        self.seen: list[Observations] = []
        self.ranges: list[NDArray[np.float64]] = []

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Reset the other policy."""
        reset_policy(self.policy, rows)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Let the other policy choose."""
        actions = self.policy.act(observations, spec)
        self.layouts.append(spec.layout)
        self.seen.append(observations.copy())
        self.ranges.append(spec.actions.to_ranges(actions, len(observations)))
        return actions


@dataclass
class Blinded:
    """A network that sees some entries as constants.

    Attributes:
        policy: the network.
        shown: the constant of each hidden column.
    """

    policy: NetworkPolicy
    shown: dict[int, float]

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Reset the network."""
        self.policy.reset(rows)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Let the network choose without the hidden entries."""
        hidden = observations.copy()
        for column, value in self.shown.items():
            hidden[:, column] = value
        return self.policy.act(hidden, spec)


def watch(entry: NamedPolicy, flocks: range) -> tuple[ObservationLayout, Observations, NDArray[np.float64]]:
    """Run a policy on some flocks of the scenario that it was trained in.

    Returns:
        Layout; observations (actions, rows, entries); ranges in m (actions, rows).
    """
    watching = Watching(entry.policy)
    rollout(None, replace(entry, policy=watching), flocks, batch_size=len(flocks))
    return watching.layouts[0], np.array(watching.seen), np.array(watching.ranges)


def ablation(file: bytes, setting: Setting, flocks: int, cache: Cache, backend: Backend) -> pl.DataFrame:
    """Measure a policy with groups of entries replaced by their means over tuning flocks.

    Args:
        file: the policy file.
        setting: the one it was trained in.
        flocks: number of held-out flocks.
        cache: of the measurements.
        backend: where they run.
    """
    layout, seen, _ = watch(stored_policy(file), seeds.first_seeds(seeds.TUNING, 20))
    means = seen.reshape(-1, seen.shape[-1]).mean(axis=0)
    held_out = seeds.first_seeds(seeds.HELD_OUT, flocks)
    hidden = {"nothing": dict[int, float]()}
    for group, beginnings in GROUPS.items():
        columns = [i for i, name in enumerate(layout.names) if name.startswith(beginnings)]
        if columns:
            hidden[group] = {column: float(means[column]) for column in columns}
    call, seconds = "studies.learned.explain:blinded", flocks * _FLOCK_SECONDS
    jobs = [
        Job(call, (file, setting.objective, tuple(shown.items()), held_out), seconds)
        for shown in hidden.values()
    ]
    results = run(jobs, cache, backend, title="Hidden entries")
    return pl.concat(
        pl.DataFrame({"removed": group, "seed": held_out, "objective": result["objective"]})
        for group, result in zip(hidden, results, strict=True)
    )


def blinded(file: bytes, objective: str, shown: tuple[tuple[int, float], ...], flocks: range) -> Arrays:
    """Return the objective of every flock under a policy that sees some columns as constants."""
    entry = stored_policy(file)
    assert isinstance(entry.policy, NetworkPolicy)  # noqa: S101, learners train networks
    episodes = rollout(None, replace(entry, policy=Blinded(entry.policy, dict(shown))), flocks)
    return {"objective": outcome(episodes, objective)}


def transfer(
    file: bytes,
    setting: Setting,
    home: float,
    flocks: int,
    grid: tuple[float, ...],
    cache: Cache,
    backend: Backend,
) -> pl.DataFrame:
    """Measure a policy and fixed ranges in scenarios that it was not trained in.

    Args:
        file: the policy file.
        setting: the one it was trained in.
        home: best fixed range of that setting, in m.
        flocks: held-out flocks per scenario; fewer for the largest flock.
        grid: ranges among which the best of each scenario is chosen, on as many tuning flocks.
        cache: of the measurements.
        backend: where they run.
    """
    worlds = dict(_worlds())
    counts = {
        name: flocks if world.num_agents <= 1_000 else max(flocks // 40, 2) for name, world in worlds.items()
    }
    tuning = {
        name: seed_jobs(SWEEP, world, grid, seeds.first_seeds(seeds.TUNING, counts[name]))
        for name, world in worlds.items()
    }
    fixed = run_groups(tuning, cache, backend, title="Fixed ranges in other scenarios")
    rows, jobs = [], []
    for name, world in worlds.items():
        held_out = seeds.first_seeds(seeds.HELD_OUT, counts[name])
        policies: dict[str, bytes | float] = {
            "learned": file,
            "best fixed range there": grid[
                int(fixed[name][OUTCOMES[setting.objective]].mean(axis=1).argmax())
            ],
            "best fixed range of the paper's flock": home,
        }
        seconds = len(held_out) * _FLOCK_SECONDS * world.num_agents / 300
        for contender, policy in policies.items():
            rows.append({"world": name, "policy": contender, "seed": held_out})
            arguments = (policy, world, setting.objective, max(grid), held_out)
            jobs.append(Job("studies.learned.explain:in_world", arguments, seconds))
    results = run(jobs, cache, backend, title="Other scenarios")
    return pl.concat(
        pl.DataFrame({**row, "objective": result["objective"]})
        for row, result in zip(rows, results, strict=True)
    )


def in_world(
    policy: bytes | float, scenario: FlockScenario, objective: str, max_range: float, flocks: range
) -> Arrays:
    """Return the objective of every flock of a scenario under a policy file, or under a fixed range in m."""
    if isinstance(policy, bytes):
        entry = stored_policy(policy)
    else:
        entry = NamedPolicy("fixed", FixedRange(policy), options={"max_range": max_range})
    return {"objective": outcome(rollout(scenario, entry, flocks), objective)}


def _worlds() -> Iterator[tuple[str, FlockScenario]]:
    for size in SIZES:
        yield f"n = {size:,}", FlockScenario(num_agents=size)
    for name in WORLDS:
        scenario = preset(name)
        assert isinstance(scenario, FlockScenario)  # noqa: S101, all of them are flocks
        yield name, scenario
