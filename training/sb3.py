"""Training with stable-baselines3 or sb3-contrib: any algorithm on any task, from the table of a learner."""

import inspect
import time
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import sb3_contrib
import stable_baselines3
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger, make_output_format
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from flockesc_env import InputError, SB3Policy
from flockesc_env.common.files import write_together
from flockesc_env.episodes.splits import training_seeds
from flockesc_env.policies.registry import Stored
from flockesc_env.sb3 import FlockEvalCallback
from training.run import BEST_FILE, MODEL_FILE, Measured, Run

_FREE = ("policy", "env", "seed", "device", "tensorboard_log", "verbose", "_init_setup_model", "self")
"""Arguments of an algorithm that a table does not set."""

STATISTICS_FILE = "vecnormalize.pkl"
EVALUATION_FLOCKS = 64
"""Tuning flocks of an evaluation. With fewer, noise decides which model is the best."""


def train(run: Run, *, resume: bool = False) -> Path:
    """Train, or continue an unfinished run, and return the path of the policy.

    The policy is the best one of the evaluations on tuning flocks, the untrained one included:
    best_model.zip, and policy.npz if it is a network. The samples do not count these flocks. model.zip is the
    last one. Rewards are scaled to unit variance of returns. A continued run starts at its last checkpoint,
    with other flocks than an uninterrupted one, and takes as many samples. It keeps the learning curve, and
    logs to progress-SAMPLES.csv.

    Raises:
        InputError: if the algorithm or a hyperparameter is unknown, or see ``Run.begin``.
        KeyboardInterrupt: on Ctrl-C, saying what continues the run.
    """
    learner, folder = run.learner, run.folder
    cls = algorithm_of(run)
    hyperparameters = run.task.hyperparameters(learner)
    torch.set_num_threads(1)  # the networks are small
    env = _env(run)
    is_unfinished = run.begin(resume=resume)
    checkpoint = run.load_checkpoint() if is_unfinished else None
    if checkpoint is not None:
        measured, packed, env_statistics, buffer, best_files = checkpoint
        env_statistics.set_venv(env)
        model = cls.load(BytesIO(packed), env=env_statistics, device="cpu")
        if buffer is not None:
            model.replay_buffer = buffer  # type: ignore[attr-defined]
        write_together({folder / name: content for name, content in best_files.items()})
    else:
        measured = Measured()
        gamma = hyperparameters.get("gamma", 0.99)
        env = VecNormalize(env, norm_obs=learner.norm_obs, clip_obs=np.inf, gamma=gamma)
        model = cls(env=env, seed=run.seed, device="cpu", **hyperparameters)
        env.seed(training_seeds(run.seed, 0, learner.num_flocks)[0])
    suffix = f"-{model.num_timesteps}" if is_unfinished else ""  # the log before stays
    logs = [make_output_format(kind, str(folder), suffix) for kind in ("csv", "tensorboard")]
    model.set_logger(Logger(str(folder), logs))
    samples = learner.samples or run.task.samples
    every = max(samples // model.n_envs // learner.num_evaluations, 1)
    evaluation = Evaluation(run, every, measured, model.n_envs)
    try:
        model.learn(
            max(samples - model.num_timesteps, 0),
            callback=evaluation,
            reset_num_timesteps=not is_unfinished,
            progress_bar=run.progress,
        )
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"{folder} holds a checkpoint; --resume continues") from None
    finally:
        model.logger.close()
    model.save(folder / MODEL_FILE)
    statistics = VecNormalize.load(str(folder / STATISTICS_FILE), _env(run))
    best: Stored | None = None
    with suppress(InputError):  # not every model is a network that a file can hold
        best = SB3Policy(cls.load(folder / BEST_FILE, env=statistics, device="cpu")).network()
    return run.finish(best, evaluation.measured())


class Evaluation(FlockEvalCallback):
    """The evaluations of a run, which continue those in ``found``.

    After an evaluation the next rollout begins with a checkpoint: the model has learned from all its samples.
    """

    def __init__(self, run: Run, eval_freq: int, found: Measured, num_envs: int) -> None:
        super().__init__(eval_freq, EVALUATION_FLOCKS, best_model_save_path=run.folder)
        self._run, self._begun = run, time.process_time() - found.cpu_seconds
        self.num_episodes, self._ended = found.evaluations, found.episodes * run.policy_spec.rows
        self.history, self.n_calls = found.curve, found.samples // num_envs
        self.best_objective = max((value for _, value in self.history), default=-np.inf)
        self._has_start, self._is_due = bool(self.history), False

    def measured(self) -> Measured:
        """Return the measurements so far."""
        episodes, seconds = self._ended // self._run.policy_spec.rows, time.process_time() - self._begun
        return Measured(episodes, self.num_episodes, self.model.num_timesteps, seconds, self.history)

    def _on_step(self) -> bool:
        self._ended += int(self.locals["dones"].sum())  # of slots
        return super()._on_step()

    def _evaluate(self) -> None:
        if not self._has_start:
            super()._evaluate()
            self._is_due = True
        self._has_start = False

    def _on_rollout_start(self) -> None:
        if self._is_due:
            model: Any = self.model
            model.save(packed := BytesIO())
            best_files = {
                name: (self._run.folder / name).read_bytes() for name in (BEST_FILE, STATISTICS_FILE)
            }
            buffer = getattr(model, "replay_buffer", None)
            parts = packed.getvalue(), model.get_vec_normalize_env(), buffer, best_files
            self._run.save_checkpoint((self.measured(), *parts))
            self._is_due = False


def algorithm_of(run: Run) -> type[BaseAlgorithm]:
    """Return the class of a run's algorithm.

    Raises:
        InputError: if neither library has it, or it lacks a hyperparameter.
    """
    known: dict[str, type[BaseAlgorithm]] = {
        name: found
        for library in (stable_baselines3, sb3_contrib)
        for name in library.__all__
        if inspect.isclass(found := getattr(library, name)) and issubclass(found, BaseAlgorithm)
    }
    if run.learner.algorithm not in known:
        expected = f"search, imitation or one of {', '.join(known)}"
        raise InputError(f"{run.name}.algorithm", expected, repr(run.learner.algorithm))
    cls = known[run.learner.algorithm]
    arguments = [name for name in inspect.signature(cls).parameters if name not in _FREE]
    for name in run.learner.hyperparameters:
        if name not in arguments:
            expected = f"arguments of {cls.__name__}: {', '.join(arguments)}"
            raise InputError(f"{run.name}.hyperparameters.{name}", expected, "an unknown one")
    return cls


def _env(run: Run) -> VecEnv:
    """Return the environment of training, with episodes of ``num_steps`` model steps."""
    options: dict[str, Any] = dict(run.learner.options)
    if run.learner.num_steps:
        options["scenario"] = run.task.scenario.replace(num_steps=run.learner.num_steps)
    return run.task.vec_env(run.learner.num_flocks, learner=None, **options)
