"""Training runs of the scoreboard as jobs: every seed of every learner on every task.

Learners of other frameworks are examples of this project, each in the environment of its framework.
"""

import json
import os
import re
import subprocess
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import numpy as np
from stable_baselines3 import PPO

from flockesc_env import SB3Policy, save_policy, tasks
from flockesc_env.jobs import Arrays, Job
from flockesc_env.models.records import versions
from flockesc_env.policies.registry import POLICY_FILE
from training.run import RUN_FILE, Run, packages_of
from training.train import train as train_run

TRANSFERRED: Final = ("held-out-predators", "held-out-sizes")
"""Tasks on which nobody trains: they score the policies of ``per-agent-visible`` that the wheel ships."""

WITHOUT_FILE: Final = "RecurrentPPO"
"""Algorithm whose models no policy file holds: `flockesc score` plays the models themselves."""

_SECONDS: Final = 60.0  # estimated processor time of a training run


class Key(NamedTuple):
    """A training run."""

    learner: str
    task: str
    seed: int


class External(NamedTuple):
    """A learner of another framework: its number of seeds by task, environment, command and packages."""

    seeds: Mapping[str, int]
    environment: str
    arguments: str
    packages: tuple[str, ...]

    def command(self, task: str, seed: int) -> str:
        """Return the command of a training run, without its output."""
        return f"{self.environment}/bin/python {self.arguments.format(task=task)} --seed {seed}"


_VISIBLE, _ZOO, _MARL = {"per-agent-visible": 5}, "rl_zoo3-ppo", ("benchmarl", "torchrl", "torch")
_ACTOR_CRITIC = {**_VISIBLE, "per-agent-local": 3, "warned-agents": 3}
EXTERNAL: Final[Mapping[str, External]] = {
    "one-file-ppo": External(_VISIBLE, ".venv", "examples/ppo_single_file.py", ("torch",)),
    "torchrl-ippo": External(_VISIBLE, ".compat/torchrl", "examples/torchrl_ppo.py", ("torchrl", "torch")),
    **{
        f"benchmarl-{name}": External(
            seeds,
            ".compat/benchmarl",
            f"examples/benchmarl_mappo.py --task {{task}} --algorithm {name}",
            _MARL,
        )
        for name, seeds in {"ippo": _ACTOR_CRITIC, "mappo": _ACTOR_CRITIC, "iql": _VISIBLE}.items()
    },
    "rllib-ppo": External(
        {"per-agent-visible": 3}, ".compat/rllib", "examples/rllib_ppo.py", ("ray", "torch")
    ),
    _ZOO: External(
        {"one-range": 3},
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


def trainings(names: Iterable[str], chosen: Iterable[str], folder: Path) -> dict[Key, Job]:
    """Return the job of every training run of some learners on some tasks; empty names mean all."""
    wanted_learners, wanted_tasks = set(names), set(chosen)
    num_seeds = {
        (learner, task): count for learner, one in EXTERNAL.items() for task, count in one.seeds.items()
    }
    for name, task in tasks.items():
        if name not in TRANSFERRED:
            num_seeds |= {
                (learner, name): one.seeds
                for learner, one in task.learners.items()
                if one.algorithm != WITHOUT_FILE
            }
    jobs = {}
    for (learner, name), count in num_seeds.items():
        if learner in (wanted_learners or {learner}) and name in (wanted_tasks or {name}):
            for seed in range(count):
                arguments = (learner, name, seed, folder.absolute())
                jobs[Key(learner, name, seed)] = Job(f"{__name__}:train", arguments, _SECONDS)
    return jobs


def train(learner: str, task: str, seed: int, folder: Path) -> Arrays:
    """Do, or continue, a training run in its folder; one of another framework starts from the beginning.

    Returns:
        ``policy``: the bytes of the policy file. ``samples``, ``episodes``, ``evaluations``,
        ``cpu_seconds`` and, of this project's learners, ``curve``: see ``training.run.Measured``.
    """
    if learner in EXTERNAL:
        return _train_external(learner, task, seed)
    run = Run.of(task, learner, seed, folder / task / f"{learner}-{seed}", progress=False)
    if not (run.folder / RUN_FILE).is_file():
        train_run(run, resume=True)
    measured = json.loads((run.folder / RUN_FILE).read_text("utf-8"))
    return _arrays(run.folder / POLICY_FILE, **measured)


def _train_external(learner: str, task: str, seed: int) -> Arrays:
    found = EXTERNAL[learner]
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd()), "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder:
        file, words = Path(folder) / "policy.npz", found.command(task, seed).split()
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
        spec = tasks[task].policy_spec
        episodes = samples // (spec.rows * spec.num_actions)
        return _arrays(file, samples=samples, episodes=episodes, evaluations=0, cpu_seconds=seconds)


def _store(folder: Path, file: Path, name: str) -> int:
    """Write the policy file of the model that rl_zoo3 saved; return the number of samples."""
    task: Any = tasks["one-range"]
    (saved,) = folder.rglob("flockesc-one-range-v1.zip")
    model = PPO.load(saved, task.vec_env(1), device="cpu", custom_objects=_SCHEDULES)
    save_policy(SB3Policy(model).network().with_options(name=name), file)
    return model.num_timesteps


def _arrays(policy: Path, **measured: Any) -> Arrays:
    raw = np.frombuffer(policy.read_bytes(), np.uint8)
    return {"policy": raw, **{name: np.array(value) for name, value in measured.items()}}


def hyperparameters_of(learner: str, task: str) -> dict[str, Any]:
    """Return the table of a learner on a task, or the command that has its hyperparameters."""
    if learner in EXTERNAL:
        return {"command": EXTERNAL[learner].command(task, 0)}
    found: dict[str, Any] = msgspec.to_builtins(tasks[task].learner(learner))
    return found


def versions_of(learner: str) -> Mapping[str, str]:
    """Return the versions with which a learner trains, of another framework those in its environment."""
    if learner not in EXTERNAL:
        return versions(*packages_of(learner))
    found = EXTERNAL[learner]
    code = "import sys, importlib.metadata as m; print(*map(m.version, sys.argv[1:]))"
    python = [f"{found.environment}/bin/python", "-c", code, *found.packages]
    ran = subprocess.run(python, check=True, capture_output=True, text=True)  # noqa: S603
    return dict(zip(found.packages, ran.stdout.split(), strict=True))
