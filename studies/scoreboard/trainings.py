"""Training runs of the scoreboard as jobs: every seed of every learner on every task."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import numpy as np

from flockesc_env.jobs import Arrays, Job
from flockesc_env.models.records import versions
from flockesc_env.policies.registry import POLICY_FILE
from flockesc_env.tasks.learners import learner_of, learners
from flockesc_env.tasks.task import tasks
from studies.scoreboard import external
from training.run import RUN_FILE, Run

_SECONDS: Final = 60.0
"""Estimated processor time of a training run."""


class Key(NamedTuple):
    """A training run."""

    learner: str
    task: str
    seed: int


def trainings(names: Iterable[str], chosen: Iterable[str], most_seeds: int, folder: Path) -> dict[Key, Job]:
    """Return the job of every training run; empty names of learners or tasks mean all."""
    wanted, on = set(names), set(chosen) or set(tasks)
    counts = {(name, one.task): one.seeds for name, one in external.LEARNERS.items()}
    counts |= {(name, task): one.seeds for task in tasks for name, one in learners(tasks[task]).items()}
    return {
        Key(name, task, seed): _job(Key(name, task, seed), folder)
        for (name, task), seeds in counts.items()
        for seed in range(min(seeds, most_seeds))
        if task in on and (not wanted or name in wanted)
    }


def train(learner: str, task: str, seed: int, folder: Path) -> Arrays:
    """Do, or continue, a training run in its folder.

    Returns:
        ``policy``: the bytes of the policy file. ``samples``, ``episodes``, ``evaluations``,
        ``cpu_seconds`` and ``curve``: see ``training.run.Measured``.
    """
    from training.train import train as run_to_end  # takes seconds to import

    run = Run.of(task, learner, seed, folder / task / f"{learner}-{seed}", progress=False)
    if not (run.folder / RUN_FILE).is_file():
        run_to_end(run, resume=True)
    measured = json.loads((run.folder / RUN_FILE).read_text("utf-8"))
    return {
        "policy": np.frombuffer((run.folder / POLICY_FILE).read_bytes(), np.uint8),
        **{name: np.array(value) for name, value in measured.items()},
    }


def hyperparameters_of(learner: str, task: str) -> dict[str, Any]:
    """Return the table of a learner on a task, or the command that has its hyperparameters."""
    if learner in external.LEARNERS:
        return {"command": external.command(learner, 0)}
    found: dict[str, Any] = msgspec.to_builtins(learner_of(tasks[task], learner))
    return found


def versions_of(learner: str) -> Mapping[str, str]:
    """Return the versions with which a learner trains."""
    if learner in external.LEARNERS:
        return external.versions_of(learner)
    return versions("cmaes", "torch", "stable-baselines3", "sb3-contrib")


def _job(key: Key, folder: Path) -> Job:
    if key.learner in external.LEARNERS:
        return Job(f"{external.__name__}:train", (key.learner, key.seed), _SECONDS)
    return Job(f"{__name__}:train", (*key, folder.absolute()), _SECONDS)
