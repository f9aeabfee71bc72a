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
from flockesc_env.common.progress import progress_bar
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.spaces import ObservationLayout
from flockesc_env.jobs import Backend, Cache
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
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


def ablation(entry: NamedPolicy, setting: Setting, flocks: int) -> pl.DataFrame:
    """Measure the policy with groups of entries replaced by their means over tuning flocks."""
    layout, seen, _ = watch(entry, seeds.first_seeds(seeds.TUNING, 20))
    assert isinstance(entry.policy, NetworkPolicy)  # noqa: S101, learners train networks
    means = seen.reshape(-1, seen.shape[-1]).mean(axis=0)
    held_out = seeds.first_seeds(seeds.HELD_OUT, flocks)
    hidden = {"nothing": dict[int, float]()}
    for group, beginnings in GROUPS.items():
        columns = [i for i, name in enumerate(layout.names) if name.startswith(beginnings)]
        hidden[group] = {column: float(means[column]) for column in columns}
    frames = []
    with progress_bar("Hidden entries", len(hidden)) as report:
        for group, shown in hidden.items():
            if group == "nothing" or shown:
                episodes = rollout(None, replace(entry, policy=Blinded(entry.policy, shown)), held_out)
                values = outcome(episodes, setting.objective)
                frames.append(pl.DataFrame({"removed": group, "seed": held_out, "objective": values}))
            report(len(frames), len(hidden))
    return pl.concat(frames)


def transfer(
    entry: NamedPolicy,
    setting: Setting,
    home: float,
    flocks: int,
    grid: tuple[float, ...],
    cache: Cache,
    backend: Backend,
) -> pl.DataFrame:
    """Measure the policy and fixed ranges in scenarios that it was not trained in.

    Args:
        entry: the policy.
        setting: the one it was trained in.
        home: best fixed range of that setting, in m.
        flocks: held-out flocks per scenario; fewer for the largest flock.
        grid: ranges among which the best of each scenario is chosen, on as many tuning flocks.
        cache: of the grid searches.
        backend: where the grid searches run.
    """
    frames = []
    names = dict(_worlds())
    counts = {
        name: flocks if world.num_agents <= 1_000 else max(flocks // 40, 2) for name, world in names.items()
    }
    tuning = {
        name: seed_jobs(SWEEP, world, grid, seeds.first_seeds(seeds.TUNING, counts[name]))
        for name, world in names.items()
    }
    fixed = run_groups(tuning, cache, backend, title="Fixed ranges in other scenarios")
    with progress_bar("Other scenarios", len(names)) as report:
        for done, (world, scenario) in enumerate(names.items(), start=1):
            held_out = seeds.first_seeds(seeds.HELD_OUT, counts[world])
            own = grid[int(fixed[world][OUTCOMES[setting.objective]].mean(axis=1).argmax())]
            options = {"max_range": max(grid)}
            policies = {
                "learned": entry,
                "best fixed range there": NamedPolicy("there", FixedRange(own), options=options),
                "best fixed range of the paper's flock": NamedPolicy(
                    "home", FixedRange(home), options=options
                ),
            }
            for name, policy in policies.items():
                episodes = rollout(scenario, policy, held_out)
                values = outcome(episodes, setting.objective)
                frames.append(
                    pl.DataFrame({"world": world, "policy": name, "seed": held_out, "objective": values})
                )
            report(done, len(names))
    return pl.concat(frames)


def _worlds() -> Iterator[tuple[str, FlockScenario]]:
    for size in SIZES:
        yield f"n = {size:,}", FlockScenario(num_agents=size)
    for name in WORLDS:
        scenario = preset(name)
        assert isinstance(scenario, FlockScenario)  # noqa: S101, all of them are flocks
        yield name, scenario
