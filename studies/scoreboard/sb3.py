"""Baseline of stable-baselines3: PPO trains on the tasks of the benchmark."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecNormalize

from flockesc_env import FlockScenario, LineEscapeEnv, LineScenario, NamedPolicy, SB3Policy, save_policy
from flockesc_env.jobs import Arrays
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv
from flockesc_env.tasks.task import Task, task_of

PPO_AGENTS: Final[dict[str, Any]] = {
    "flocks": 4,
    "learning_rate": 1e-3,
    "batch_size": 6000,
    "gamma": 0.98,
    "net_arch": [32, 32],
    "log_std_init": 0.0,
}
"""Hyperparameters of PPO with one range per agent, as in examples/sb3_ppo.py."""

PPO_FLOCKS: Final[dict[str, Any]] = {
    "flocks": 64,
    "learning_rate": 3e-4,
    "batch_size": 480,
    "gamma": 0.99,
    "net_arch": [64, 64],
    "log_std_init": -0.7,
}
"""Hyperparameters of PPO with one range for the flock or the line."""

_LINE_STEPS: Final = 64
"""Actions of a line in a round; its episodes last about 7."""


def hyperparameters(task: Task) -> dict[str, Any]:
    """Return the hyperparameters of PPO on a task."""
    return {**(PPO_AGENTS if task.per_agent else PPO_FLOCKS), "n_epochs": 5, "reward": _reward(task)}


def train(learner: str, name: str, seed: int) -> Arrays:
    """Train on a task with its number of samples.

    Returns:
        ``policy``: the bytes of the policy file. ``cpu_seconds``: processor time. ``samples``: number of
        actions. ``curve_samples``, ``curve_cpu_seconds`` and ``curve_objective``: samples, processor time and
        mean objective of the episodes of training, of every round.
    """
    torch.set_num_threads(1)
    task = task_of(name)
    chosen = hyperparameters(task)
    env = VecNormalize(_env(task, chosen["flocks"]), norm_obs=False, gamma=chosen["gamma"])
    curve = _Curve(task.spec.column, _episode_actions(task))
    model = _ppo(task, env, chosen, seed)
    start = time.process_time()
    model.learn(task.samples, callback=curve)
    cpu_seconds = time.process_time() - start
    rows = np.array(curve.rows, np.float64).reshape(-1, 3)
    return {
        "policy": policy_bytes(model, task, f"{learner}-{seed}"),
        "cpu_seconds": np.array(cpu_seconds),
        "samples": np.array(model.num_timesteps),
        "curve_samples": rows[:, 0],
        "curve_cpu_seconds": rows[:, 1],
        "curve_objective": rows[:, 2],
    }


def policy_bytes(model: PPO, task: Task, name: str) -> NDArray[np.uint8]:
    """Return the bytes of the policy file of a model that was trained on a task."""
    entry = NamedPolicy(name, SB3Policy(model).network(), task.per_agent, dict(task.options), task.scenario)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "policy.npz"
        save_policy(entry, file)
        return np.frombuffer(file.read_bytes(), np.uint8)


def _reward(task: Task) -> str:
    if task.spec.model == "line":
        return "change"
    return "individual_running_minimum" if task.per_agent else "running_minimum"


def _env(task: Task, flocks: int) -> VecEnv:
    options: dict[str, Any] = {**task.options, "reward": _reward(task)}
    scenario = task.scenario
    if isinstance(scenario, LineScenario):
        return DummyVecEnv([lambda: LineEscapeEnv(scenario, **options)] * flocks)
    return (AgentVecEnv if task.per_agent else FlockVecEnv)(flocks, scenario, infos="end", **options)


def _episode_actions(task: Task) -> int:
    scenario, steps = task.scenario, int(task.options["steps_per_action"])
    return -(-scenario.num_steps // steps) if isinstance(scenario, FlockScenario) else _LINE_STEPS


def _ppo(task: Task, env: VecEnv, chosen: dict[str, Any], seed: int) -> PPO:
    return PPO(
        "MlpPolicy",
        env,
        learning_rate=lambda left: chosen["learning_rate"] * left,  # falls to 0
        n_steps=_episode_actions(task),
        batch_size=chosen["batch_size"],
        n_epochs=chosen["n_epochs"],
        gamma=chosen["gamma"],
        policy_kwargs={"net_arch": chosen["net_arch"], "log_std_init": chosen["log_std_init"]},
        seed=seed,
        device="cpu",
    )


class _Curve(BaseCallback):
    """Records samples, processor time and the mean objective of the episodes that end in every round."""

    def __init__(self, column: str, round_actions: int) -> None:
        super().__init__()
        self.rows: list[tuple[float, float, float]] = []
        self._column, self._round = column, round_actions
        self._ended: list[float] = []
        self._start = time.process_time()

    def _on_step(self) -> bool:
        ended = np.flatnonzero(self.locals["dones"])
        self._ended += [float(self.locals["infos"][slot][self._column]) for slot in ended]
        if self._ended and self.n_calls % self._round == 0:
            seconds = time.process_time() - self._start
            self.rows.append((self.num_timesteps, seconds, float(np.mean(self._ended))))
            self._ended = []
        return True
