"""Baseline of rl_zoo3: its command trains on the task `shared`, as examples/rl_zoo3 says."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from stable_baselines3 import PPO

from flockesc_env.jobs import Arrays
from flockesc_env.sb3 import FlockVecEnv
from flockesc_env.tasks.task import task_of
from studies.scoreboard.sb3 import policy_bytes

LEARNER: Final = "rl_zoo3-ppo"
TASK: Final = "shared"
SEEDS: Final[Mapping[str, Mapping[str, int]]] = {LEARNER: {TASK: 3}}
PACKAGES: Final = ("rl_zoo3", "stable-baselines3", "torch")
PYTHON: Final = ".compat/rl_zoo3/bin/python"


_SCHEDULES: Final = dict.fromkeys(("learning_rate", "lr_schedule", "clip_range"), 0.0)
"""Schedules of training in the file are functions of rl_zoo3, which is not installed here."""


def command(seed: int) -> str:
    """Return the command of a training run, without its folder."""
    return (
        f"{PYTHON} -m rl_zoo3.train --algo ppo --env flockesc/FlockEscape-v0 --gym-packages flockesc_env"
        f" -conf examples/rl_zoo3/ppo.yml --n-timesteps {task_of(TASK).samples} --eval-freq -1"
        f" --device cpu --seed {seed}"
    )


def train(_: str, name: str, seed: int) -> Arrays:
    """Run rl_zoo3; return the bytes of the policy file, the samples and the processor time."""
    task = task_of(name)
    options: dict[str, Any] = dict(task.options)
    with tempfile.TemporaryDirectory() as folder:
        start = os.times().children_user + os.times().children_system
        environment = {**os.environ, "PYTHONPATH": str(Path.cwd()), "OMP_NUM_THREADS": "1"}
        words = [*command(seed).split(), "--log-folder", folder]
        subprocess.run(words, check=True, capture_output=True, env=environment)  # noqa: S603, constants
        seconds = os.times().children_user + os.times().children_system - start
        (saved,) = Path(folder).rglob("flockesc-FlockEscape-v0.zip")
        model = PPO.load(saved, FlockVecEnv(1, **options), device="cpu", custom_objects=_SCHEDULES)
        return {
            "policy": policy_bytes(model, task, f"{LEARNER}-{seed}"),
            "samples": np.array(model.num_timesteps),
            "cpu_seconds": np.array(seconds),
        }
