"""Learners of other frameworks: the examples of this project, each in the environment of its framework."""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from stable_baselines3 import PPO

from flockesc_env import SB3Policy, save_policy
from flockesc_env.jobs import Arrays
from flockesc_env.tasks import tasks


class External(NamedTuple):
    """A learner: its task and number of seeds, environment, command and packages."""

    task: str
    seeds: int
    environment: str
    command: str
    packages: tuple[str, ...]


_TASK, _ZOO, _MARL = "per-agent-visible", "rl_zoo3-ppo", ("benchmarl", "torchrl", "torch")
LEARNERS: Final[Mapping[str, External]] = {
    "one-file-ppo": External(_TASK, 5, ".venv", "examples/ppo_single_file.py", ("torch",)),
    "torchrl-ippo": External(_TASK, 5, ".compat/torchrl", "examples/torchrl_ppo.py", ("torchrl", "torch")),
    **{
        f"benchmarl-{name}": External(
            _TASK, 5, ".compat/benchmarl", f"examples/benchmarl_mappo.py --algorithm {name}", _MARL
        )
        for name in ("ippo", "mappo", "iql")
    },
    "rllib-ppo": External(_TASK, 3, ".compat/rllib", "examples/rllib_ppo.py", ("ray", "torch")),
    _ZOO: External(
        "one-range",
        3,
        ".compat/rl_zoo3",
        "-m rl_zoo3.train --algo ppo --env flockesc/one-range-v1 --gym-packages flockesc_env"
        " -conf examples/rl_zoo3/ppo.yml --eval-freq -1 --device cpu"
        f" --n-timesteps {tasks['one-range'].samples}",
        ("rl_zoo3", "stable-baselines3", "torch"),
    ),
}
"""`make compat-NAME` creates the environment .compat/NAME. The examples train on the options of the task."""

_SPEED: Final = re.compile(r"(\d+) samples in ([\d.]+) s of CPU time")
_SCHEDULES: Final = dict.fromkeys(("learning_rate", "lr_schedule", "clip_range"), 0.0)
"""Schedules of training in the file are functions of rl_zoo3, which is not installed here."""


def command(learner: str, seed: int) -> str:
    """Return the command of a training run, without its output."""
    found = LEARNERS[learner]
    return f"{found.environment}/bin/python {found.command} --seed {seed}"


def versions_of(learner: str) -> dict[str, str]:
    """Return the versions of a learner's packages in its environment."""
    found = LEARNERS[learner]
    code = "import sys, importlib.metadata as m; print(*map(m.version, sys.argv[1:]))"
    python = [f"{found.environment}/bin/python", "-c", code, *found.packages]
    ran = subprocess.run(python, check=True, capture_output=True, text=True)  # noqa: S603
    return dict(zip(found.packages, ran.stdout.split(), strict=True))


def train(learner: str, seed: int) -> Arrays:
    """Run a command; return the bytes of its policy file, the samples and the processor time."""
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd()), "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder:
        file, words = Path(folder) / "policy.npz", command(learner, seed).split()
        is_zoo = learner == _ZOO
        words += ["--log-folder", folder] if is_zoo else ["--held-out", "2", "--output", str(file)]
        start = os.times()
        ran = subprocess.run(words, check=True, capture_output=True, text=True, env=environment)  # noqa: S603
        end = os.times()
        if is_zoo:
            samples = _store(Path(folder), file, f"{learner}-{seed}")
            seconds = sum(end[2:4]) - sum(start[2:4])  # of child processes
        else:
            count, spent = _SPEED.findall(ran.stdout)[-1]
            samples, seconds = int(count), float(spent)
        raw = np.frombuffer(file.read_bytes(), np.uint8)
    spec = tasks[LEARNERS[learner].task].policy_spec()
    counts = {"samples": samples, "episodes": samples // (spec.rows * spec.num_actions), "evaluations": 0}
    return {"policy": raw, "cpu_seconds": np.array(seconds), **{k: np.array(n) for k, n in counts.items()}}


def _store(folder: Path, file: Path, name: str) -> int:
    """Write the policy file of the model that rl_zoo3 saved; return the number of samples."""
    task: Any = tasks["one-range"]
    (saved,) = folder.rglob("flockesc-one-range-v1.zip")
    model = PPO.load(saved, task.vec_env(1), device="cpu", custom_objects=_SCHEDULES)
    save_policy(SB3Policy(model).network().with_options(name=name), file)
    return model.num_timesteps
