"""A setting so small that all of its study takes seconds, and a spy on its training runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from training.config import Args

import training.train
from flockesc_env import FlockScenario
from flockesc_env.jobs import Job
from flockesc_env.jobs.sweeps import OUTCOMES
from studies.findings import explain, playing, watching
from training import evaluation

TINY = FlockScenario(num_agents=8, num_steps=16, initial_side=20.0)

PRESET = """
title = "eight agents"

[setting]
scenario = "{scenario}"
max_range = 30.0

[learners.search]
kind = "search"
seeds = 2
inputs = ["predator_distance", "predator_direction_left", "neighbor_count"]
hidden = [3]
memory = 1
population = 4
flocks = 2
final_flocks = 4
generations = 4
checkpoint_every = 2

[learners.schedule]
kind = "search"
seeds = 1
inputs = ["time"]
hidden = [2]
population = 4
flocks = 2
final_flocks = 2
generations = 2
note = "an open-loop schedule"

[learners.unreported]
kind = "search"
population = 4
generations = 2
"""


def write_preset(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make ``tiny`` the only preset."""
    configs = folder / "configs"
    configs.mkdir()
    (folder / "tiny-flock.toml").write_text(TINY.to_toml())
    (configs / "tiny.toml").write_text(PRESET.format(scenario=folder / "tiny-flock.toml"))
    monkeypatch.setattr("training.presets.PRESETS", configs)


class Spy:
    """Notes training runs, jobs and the seeds of all flocks in this process.

    Attributes:
        trained: arguments of the training runs.
        training: seeds of the flocks that were played during one.
        elsewhere: seeds of all others.
        jobs: all jobs except for training runs.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.trained: list[Args] = []
        self.training: set[int] = set()
        self.elsewhere: set[int] = set()
        self.jobs: list[Job] = []
        self._is_training = False
        self._train = training.train.train
        monkeypatch.setattr(training.train, "train", self.train)
        for module in (evaluation, explain, playing, watching):
            monkeypatch.setattr(module, "rollout", self._noting(module.rollout))
        noted = self._noting(evaluation.rollout_networks)
        monkeypatch.setattr(evaluation, "rollout_networks", noted)
        job_run = Job.run

        def run_job(job: Job) -> Any:
            if not job.function.startswith("training."):
                self.jobs.append(job)
            if job.function == OUTCOMES:
                self._note(job.arguments[2])
            return job_run(job)

        monkeypatch.setattr(Job, "run", run_job)

    def forget(self) -> None:
        """Forget everything."""
        self.trained.clear()
        self.training.clear()
        self.elsewhere.clear()
        self.jobs.clear()

    def train(self, args: Args) -> Path:
        """Train, as ``training.train.train`` does."""
        self.trained.append(args)
        self._is_training = True
        try:
            return self._train(args)
        finally:
            self._is_training = False

    def _noting(self, rollout: Callable[..., Any]) -> Callable[..., Any]:
        def noted(*args: Any, **options: Any) -> Any:
            self._note(args[2] if len(args) > 2 else options["seeds"])
            return rollout(*args, **options)

        return noted

    def _note(self, seeds: Any) -> None:
        (self.training if self._is_training else self.elsewhere).update(seeds)
