"""A setting so small that all of its study takes seconds, and training runs in this process."""

from __future__ import annotations

import runpy
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

import training
from flockesc_env import FlockScenario
from flockesc_env.jobs import Job
from studies.learned import explain
from training import evaluation, processes

TINY = FlockScenario(num_agents=8, num_steps=16, initial_side=20.0)
COMMANDS = Path(training.__file__).parent / "__main__.py"

PRESET = """
title = "eight agents"
explained = "search"

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
    monkeypatch.setattr("training.config.PRESETS", configs)


class Spy:
    """Runs commands in this process, one at a time, and notes the seeds of all flocks.

    Attributes:
        commands: that were run.
        training: seeds of the flocks that were played while one ran.
        elsewhere: seeds of all others.
        jobs: fixed ranges that were computed.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.commands: list[list[str]] = []
        self.training: set[int] = set()
        self.elsewhere: set[int] = set()
        self.jobs: list[Job] = []
        self._is_training = False
        self._patch = monkeypatch
        monkeypatch.setattr(processes.subprocess, "run", self.run)
        for module in (evaluation, explain):
            monkeypatch.setattr(module, "rollout", self._noting(module.rollout))
        job_run = Job.run

        def run_job(job: Job) -> Any:
            self.jobs.append(job)
            self._note(job.arguments[2])
            return job_run(job)

        monkeypatch.setattr(Job, "run", run_job)

    def forget(self) -> None:
        """Begin anew."""
        self.commands.clear()
        self.training.clear()
        self.elsewhere.clear()
        self.jobs.clear()

    def run(self, command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        """Run ``python -m training ..``, as ``subprocess.run`` does."""
        assert command[:3] == [sys.executable, "-m", "training"]
        self.commands.append(command)
        self._is_training = True
        try:
            with self._patch.context() as patch, redirect_stderr(StringIO()) as told:
                patch.setattr(sys, "argv", [str(COMMANDS), *command[3:]])
                runpy.run_path(str(COMMANDS), run_name="__main__")
        except SystemExit as stop:
            return subprocess.CompletedProcess(command, int(stop.code or 0), "", told.getvalue())
        finally:
            self._is_training = False
        return subprocess.CompletedProcess(command, 0, "", "")

    def _noting(self, rollout: Callable[..., Any]) -> Callable[..., Any]:
        def noted(*args: Any, **options: Any) -> Any:
            self._note(args[2] if len(args) > 2 else options["seeds"])
            return rollout(*args, **options)

        return noted

    def _note(self, seeds: Any) -> None:
        (self.training if self._is_training else self.elsewhere).update(seeds)
