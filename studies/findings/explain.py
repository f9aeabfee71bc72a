"""Ablation of a learned policy: entries of its observation that are hidden."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray
from training.config import Setting

from flockesc_env import Policy, PolicySpec, rollout
from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.episodes import splits
from flockesc_env.episodes.policy_reset import reset_policy
from flockesc_env.jobs import Arrays, Job
from studies.findings.listening import LISTENING_FILE, WATCHED, measure_listening
from studies.findings.results import STUDY_FILE, Study
from studies.findings.summary import NOTHING
from studies.findings.watching import Observations, watch
from studies.measurements import Runner
from studies.playing import policy_of
from studies.study import document
from studies.tables import rows

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
    """A policy that sees a constant instead of each entry in a column of ``shown``."""

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


def write_explanations(study: Study, setting: Setting, runner: Runner) -> None:
    """Hide entries from the headline policy of a flock's setting; its name goes into the file of the study.

    The headline policy is that of the best learner on tuning flocks, and of its training seed that is best
    there.
    """
    file, path = study.file().read_bytes(), study.folder / STUDY_FILE
    flocks = min(study.held_out_flocks, EXPLAINED_FLOCKS)
    write_table(ablation(file, setting, flocks, runner), study.folder / "ablation.parquet")
    if study.setting in WATCHED:
        measure_listening(policy_of(file), study.folder / LISTENING_FILE)
    headline = {"explained": study.best_learner, "explained_seed": study.best_seed}
    write_text(path, document(json.loads(path.read_text("utf-8")) | headline))


def ablation(file: bytes, setting: Setting, flocks: int, runner: Runner) -> pl.DataFrame:
    """Measure a policy with groups of entries replaced by their means over tuning flocks."""
    layout, seen, _ = watch(policy_of(file), splits.first_seeds(splits.TUNING, 20))
    means = seen.reshape(-1, seen.shape[-1]).mean(axis=0)
    held_out = splits.first_seeds(splits.HELD_OUT, flocks)
    hidden = {NOTHING: dict[int, float]()}
    names = [_PROFILE.sub("", name) for name in layout.names]
    for group, beginnings in GROUPS.items():
        columns = [column for column, name in enumerate(names) if name.startswith(beginnings)]
        if columns:
            hidden[group] = {column: float(means[column]) for column in columns}
    call, seconds = f"{__name__}:blinded", flocks * _FLOCK_SECONDS
    jobs = {
        group: Job(call, (file, setting.spec.column, tuple(shown.items()), held_out), seconds)
        for group, shown in hidden.items()
    }
    found = runner.each(jobs, "Hidden entries")
    return pl.concat(rows(held_out, result["objective"], removed=group) for group, result in found.items())


def blinded(file: bytes, column: str, shown: tuple[tuple[int, float], ...], flocks: range) -> Arrays:
    """Return the objective of every flock under a policy that sees some columns as constants."""
    entry = policy_of(file)
    episodes = rollout(None, replace(entry, policy=Blinded(entry.policy, dict(shown))), flocks)
    return {"objective": getattr(episodes, column)}
