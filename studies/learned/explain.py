"""Ablation of a learned policy: entries of its observation that are hidden."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from flockesc_env import Policy, PolicySpec, rollout
from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from studies.learned.held_out import stored_policy
from studies.learned.listening import LISTENING_FILE, WATCHED, measure_listening
from studies.learned.results import POLICIES, STUDY_FILE, Study
from studies.learned.summary import NOTHING
from studies.learned.watching import Observations, watch
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

EXPLAINED_FLOCKS = 100
"""Held-out flocks of ablations."""

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
    cache: Cache,
    backend: Backend,
    folder: Path,
) -> None:
    """Hide entries from the headline policy of a flock's setting.

    The headline policy is that of the best learner on tuning flocks, and of its training seed that is best
    there. Its name goes into the file of the study.

    Args:
        study: results of the setting.
        setting: the task.
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
