"""Ablation and transfer of a learned policy: hidden entries of its observation, other scenarios."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from flockesc_env import (
    FixedRange,
    FlockScenario,
    NamedPolicy,
    Policy,
    PolicySpec,
    preset,
    rollout,
)
from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
from studies.learned.held_out import stored_policy
from studies.learned.listening import LISTENING_FILE, WATCHED, measure_listening
from studies.learned.results import POLICIES, STUDY_FILE, Study
from studies.learned.summary import BEST_THERE, LEARNED, NOTHING
from studies.learned.watching import Observations, watch
from studies.measurements import run_groups
from training import seeds
from training.config import Setting

GROUPS: dict[str, tuple[str, ...]] = {
    "time": ("time",),
    "escape direction": ("escape_", "heard_escape_gain", "heading_escape"),
    "closest approach": ("closest_", "heard_closest_approach"),
    "predator direction": ("predator_direction", "heading_away", "velocity_away"),
    "predator distance": ("predator_distance", "mean_distance", "min_distance", "centroid_distance"),
    "predator velocity": ("predator_velocity", "predator_speed", "predator_aim"),
    "heard velocity": ("heard_velocity", "velocity_ahead", "velocity_left"),
    "number of neighbors": ("neighbor_count",),
    "alignment": ("polarization", "heard_alignment"),
    "last range": ("last_range",),
    "running minimum": ("running_minimum",),
}
"""Entries of an observation that are hidden together, by the beginnings of their names.

The entries of candidate ranges belong to them without ``profile_k_``.
"""

SIZES = (100, 1_000, 10_000)
HOME = "paper-flock"
WORLDS = ("edge-attack", "pursuit", "intercept", "wandering", "two-predators", "assigned-pair", "clusters")
"""Presets in which policies are tried besides the paper's flock and its other sizes."""

EXPLAINED_FLOCKS = 100
"""Held-out flocks of ablations and other scenarios."""

_PROFILE = re.compile(r"^profile_\d+_")

_FLOCK_SECONDS = 0.05
"""Estimated time of an episode of 300 agents under a policy."""


@dataclass
class Blinded:
    """A policy that sees some entries as constants.

    Attributes:
        policy: the policy.
        shown: the constant of each hidden column.
    """

    policy: Policy
    shown: dict[int, float]

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Reset the policy."""
        reset_policy(self.policy, rows)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Let the policy choose without the hidden entries."""
        hidden = observations.copy()
        for column, value in self.shown.items():
            hidden[:, column] = value
        return self.policy.act(hidden, spec)


def write_explanations(
    study: Study,
    setting: Setting,
    grid: tuple[float, ...],
    cache: Cache,
    backend: Backend,
    folder: Path,
) -> None:
    """Hide entries from the headline policy of a flock's setting, and run it in other scenarios.

    The headline policy is that of the best learner on tuning flocks, and of its training seed that is best
    there. Its name goes into the file of the study.

    Args:
        study: results of the setting.
        setting: the task.
        grid: fixed ranges among which the best of each scenario is chosen.
        cache: of the measurements.
        backend: where they run.
        folder: folder of the results.

    Raises:
        JobError: if jobs fail.
    """
    learner, seed = study.best_learner, study.best_seed
    file = (folder / POLICIES / f"{learner}-{seed}.npz").read_bytes()
    flocks = min(study.held_out_flocks, EXPLAINED_FLOCKS)
    write_table(ablation(file, setting, flocks, cache, backend), folder / "ablation.parquet")
    write_table(transfer(file, setting, flocks, grid, cache, backend), folder / "transfer.parquet")
    if study.setting in WATCHED:
        measure_listening(stored_policy(file), folder / LISTENING_FILE)
    document = json.loads((folder / STUDY_FILE).read_text())
    document |= {"explained": learner, "explained_seed": seed}
    write_text(folder / STUDY_FILE, json.dumps(document, indent=1) + "\n")


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
    hidden = {NOTHING: dict[int, float]()}
    for group, beginnings in GROUPS.items():
        names = [_PROFILE.sub("", name) for name in layout.names]
        columns = [column for column, name in enumerate(names) if name.startswith(beginnings)]
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
    episodes = rollout(None, replace(entry, policy=Blinded(entry.policy, dict(shown))), flocks)
    return {"objective": FLOCK_OBJECTIVES[objective].values(episodes)}


def transfer(
    file: bytes,
    setting: Setting,
    flocks: int,
    grid: tuple[float, ...],
    cache: Cache,
    backend: Backend,
) -> pl.DataFrame:
    """Measure a policy and the best fixed range in several scenarios.

    Args:
        file: the policy file.
        setting: the one it was trained in.
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
            LEARNED: file,
            BEST_THERE: grid[int(fixed[name][setting.spec.column].mean(axis=1).argmax())],
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
    return {"objective": FLOCK_OBJECTIVES[objective].values(rollout(scenario, entry, flocks))}


def _worlds() -> Iterator[tuple[str, FlockScenario]]:
    yield HOME, FlockScenario()
    for size in SIZES:
        yield f"n = {size:,}", FlockScenario(num_agents=size)
    for name in WORLDS:
        scenario = preset(name)
        assert isinstance(scenario, FlockScenario)  # noqa: S101, all of them are flocks
        yield name, scenario
