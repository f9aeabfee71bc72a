"""``Run``: a training run, the files of its folder, and the record that repeats or continues it.

- config.json: task, learner, seed and versions.
- policy.npz: the policy; of stable-baselines3 also model.zip and best_model.zip.
- run.json: samples, episodes, processor time and the learning curve. It is written last.
"""

from __future__ import annotations

import json
import pickle
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec

from flockesc_env import InputError, Policy, save_policy, tasks
from flockesc_env.common.checks import parse_json
from flockesc_env.common.files import check_writable, read_sealed, write_sealed, write_text
from flockesc_env.common.stats import FloatArray
from flockesc_env.models.records import versions
from flockesc_env.policies import PolicySpec
from flockesc_env.policies.registry import POLICY_FILE, Stored
from flockesc_env.policies.rollout import play
from flockesc_env.policies.setup import Setup, setup
from flockesc_env.taskset import Task
from flockesc_env.taskset.learners import Learner

CONFIG_FILE = "config.json"
RUN_FILE = "run.json"
BEST_FILE = "best_model.zip"
MODEL_FILE = "model.zip"
CHECKPOINT_FILE = "checkpoint.pickle"
CURVE_FLOCKS = 200
"""Tuning flocks on which the learning curves of all but stable-baselines3 are measured."""


def packages_of(algorithm: str) -> tuple[str, ...]:
    """Return the packages whose versions decide what an algorithm learns."""
    if algorithm == "gradient":
        return "jax", "jaxlib", "optax"
    return "cmaes", "sb3-contrib", "stable-baselines3", "torch"


@dataclass(frozen=True, kw_only=True)
class Run:
    """A training run.

    Attributes:
        task: the task.
        name: name of the learner.
        learner: its algorithm and hyperparameters.
        seed: seed of the learner and of the training flocks.
        folder: folder of the files.
        progress: show a progress bar.
    """

    task: Task
    name: str
    learner: Learner
    seed: int
    folder: Path
    progress: bool = True

    @classmethod
    def of(cls, task: str, learner: str, seed: int, folder: Path, *, progress: bool = True) -> Run:
        """Return the run of a task's learner.

        Raises:
            InputError: if the task or the learner is unknown.
        """
        chosen = tasks[task]
        found = chosen.learner(learner)
        return cls(task=chosen, name=learner, learner=found, seed=seed, folder=folder, progress=progress)

    @cached_property
    def options(self) -> dict[str, Any]:
        """Options of the environment: those of the task, and those that the learner replaces."""
        return {**self.task.options, **self.learner.options}

    @cached_property
    def policy_spec(self) -> PolicySpec:
        """Observations and actions of the environment."""
        return self.task.spec_with(**self.learner.options)

    def setup(self, policy: Policy) -> Setup:
        """Return how a policy plays in the environment, on one thread."""
        task = self.task
        return setup(policy, task.scenario, per_agent=task.per_agent, num_threads=1, **self.options)

    def objectives(self, policy: Policy, seeds: Sequence[int], *, batch_size: int = 64) -> FloatArray:
        """Play a policy; return the objective, shape (seeds,)."""
        return play(self.setup(policy), seeds, batch_size=batch_size)[self.task.spec.name]

    def record(self) -> dict[str, Any]:
        """Return what decides the results of the run."""
        return {
            "task": self.task.name,
            "task_sha256": self.task.sha256,
            "learner": self.name,
            "table": msgspec.to_builtins(self.learner),
            "seed": self.seed,
            "versions": versions(*packages_of(self.learner.algorithm)),
        }

    def begin(self, *, resume: bool) -> bool:
        """Make the folder with the run's record; return whether the folder holds an unfinished run.

        Raises:
            InputError: if the folder holds a finished run, a run with another record, or an unfinished one
                that ``resume`` does not allow to continue; if the record is damaged.
            OSError: if files cannot be written there.
        """
        path = self.folder / CONFIG_FILE
        if (self.folder / RUN_FILE).exists():
            raise InputError("run", "a folder without a finished run", self.folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        check_writable(self.folder / CHECKPOINT_FILE)
        if not path.exists():
            if any(self.folder.iterdir()):
                raise InputError("run", "an empty folder or one of a run", self.folder)
            write_text(path, json.dumps(self.record(), indent=1) + "\n")
            return False
        try:
            found = parse_json(path.read_text("utf-8"))
        except ValueError as error:
            raise InputError(str(path), "the record of a run", error) from None
        if found != json.loads(json.dumps(self.record())):
            raise InputError("run", f"the task, learner, seed and versions of {path}", "others")
        if not resume:
            raise InputError("run", "a new folder, or --resume to continue the run in it", self.folder)
        return True

    def save_checkpoint(self, state: Any) -> None:
        """Write what the rest of the run needs."""
        write_sealed(self.folder / CHECKPOINT_FILE, json.dumps(self.record()), pickle.dumps(state))

    def load_checkpoint(self) -> Any:
        """Return the last checkpoint, or ``None`` without one.

        Raises:
            InputError: if it is damaged.
        """
        path = self.folder / CHECKPOINT_FILE
        if not path.is_file():
            return None
        content = read_sealed(path, json.dumps(self.record()))
        if content is None:
            expected = "a checkpoint of this run; delete the folder to start from the beginning"
            raise InputError(str(path), expected, "a damaged one")
        return pickle.loads(content)  # noqa: S301, of our own making

    def finish(self, policy: Stored | None, measured: Measured) -> Path:
        """Write the policy, if a file can hold it, and the measurements; return the policy's path."""
        path = self.folder / POLICY_FILE
        if policy is not None:
            known = {name: value for name, value in self.options.items() if name != "reward"}
            known |= {"per_agent": self.task.per_agent, "scenario": self.task.scenario}
            known |= {"action_mode": "normalized", "range_grid": None, **(policy.options or {})}
            save_policy(policy.with_options(name=self.folder.name or self.name, **known), path)
        write_text(self.folder / RUN_FILE, json.dumps(vars(measured), indent=1) + "\n")
        (self.folder / CHECKPOINT_FILE).unlink(missing_ok=True)
        return path if policy is not None else self.folder / BEST_FILE


@dataclass
class Measured:
    """Measurements of a run.

    Attributes:
        episodes: number of episodes of training.
        evaluations: number of further episodes, on tuning flocks.
        samples: number of chosen actions in training, one per agent or one per flock.
        cpu_seconds: processor time.
        curve: samples and mean objective on tuning flocks, of every evaluation.
    """

    episodes: int = 0
    evaluations: int = 0
    samples: int = 0
    cpu_seconds: float = 0.0
    curve: list[tuple[int, float]] = field(default_factory=list)
