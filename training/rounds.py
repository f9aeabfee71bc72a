"""Training with stable-baselines3 in rounds.

Every round seeds the random generators and starts new flocks. It depends only on the networks, optimizers and
scale of rewards after the previous round.
"""

from __future__ import annotations

import time
from abc import abstractmethod
from functools import partial
from math import nan
from statistics import fmean
from typing import Any, TypeVar

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecEnvWrapper, VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from flockesc_env import FlockScenario, LineEscapeEnv, LineScenario, NetworkPolicy, SB3Policy
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv
from flockesc_env.tasks.seeds import training_seeds
from training.config import SB3Args
from training.outputs import Measured
from training.train import Rounds

LINE_ACTIONS = 64
"""Actions per round on the line, where episodes last about 7 steps."""

A = TypeVar("A", bound=SB3Args)


class SB3Rounds(Rounds[A]):
    """A run of one algorithm of stable-baselines3.

    Attributes:
        model: the model of stable-baselines3.
        steps: number of actions per round.
    """

    def __init__(self, args: A) -> None:
        super().__init__(args)
        training_seeds(args.seed, 0, args.num_flocks * args.num_episodes)  # raises if there are too few seeds
        torch.set_num_threads(1)
        scenario = self.scenario()
        self.steps = LINE_ACTIONS
        if isinstance(scenario, FlockScenario):
            self.steps = -(-scenario.num_steps // args.steps_per_action)
        env = self.make_env(scenario, {**args.env_options(), "reward": args.reward})
        self._timed = _Timed(env, args.spec.column)
        # Observations are already scaled; rewards are scaled to unit variance of returns.
        self._env = VecNormalize(self._timed, norm_obs=False, gamma=args.gamma)
        self.model = self.make(self._env)
        self.model.set_logger(Logger(None, []))

    @abstractmethod
    def make(self, env: VecEnv) -> BaseAlgorithm:
        """Return a new model."""

    def scenario(self) -> FlockScenario | LineScenario:
        """Return the scenario of training."""
        return self.args.model

    def make_env(self, scenario: FlockScenario | LineScenario, options: dict[str, Any]) -> VecEnv:
        """Return the environment of training."""
        args = self.args
        if isinstance(scenario, LineScenario):
            return DummyVecEnv([partial(LineEscapeEnv, scenario, **options)] * args.num_flocks)
        make = AgentVecEnv if args.per_agent else FlockVecEnv
        return make(args.num_flocks, scenario, num_threads=1, **options)

    def policy(self) -> NetworkPolicy:
        """Return the deterministic policy."""
        return SB3Policy(self.model).network()

    def state(self) -> dict[str, Any]:
        """Return networks, optimizers and the running variance of returns."""
        model = self.model
        learned = {"parameters": model.get_parameters(), "num_timesteps": model.num_timesteps}
        return {**learned, "reward_scale": self._env.ret_rms}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore the state that ``state`` returned."""
        self.model.set_parameters(state["parameters"])
        self.model.num_timesteps, self._env.ret_rms = state["num_timesteps"], state["reward_scale"]

    def round(self) -> float:
        """Train on new flocks; return the mean objective of their episodes."""
        args, model = self.args, self.model
        model.set_random_seed(int(np.random.SeedSequence([args.seed, self.completed]).generate_state(1)[0]))
        self._env.seed(training_seeds(args.seed, self.completed * args.num_flocks, args.num_flocks)[0])
        model.set_env(self._env)  # makes the model reset it before the first step
        steps = self.steps * self._env.num_envs
        model.learn(steps, log_interval=None, reset_num_timesteps=False)  # type: ignore[arg-type]
        self.measured.samples = model.num_timesteps
        return self._timed.report(self.measured, self._env.num_envs // args.num_flocks)


class _Timed(VecEnvWrapper):
    """Wrapper that measures processor time in an environment, and the objectives of finished episodes."""

    def __init__(self, venv: VecEnv, column: str) -> None:
        super().__init__(venv)
        self._column = column
        self._seconds, self._objectives = 0.0, list[float]()

    def reset(self) -> VecEnvObs:
        begun = time.process_time()
        observations = self.venv.reset()
        self._seconds += time.process_time() - begun
        return observations

    def step_wait(self) -> VecEnvStepReturn:
        begun = time.process_time()
        result = self.venv.step_wait()
        self._seconds += time.process_time() - begun
        _, _, dones, infos = result
        self._objectives += [infos[slot][self._column] for slot in np.flatnonzero(dones)]
        return result

    def report(self, measured: Measured, slots: int) -> float:
        """Add time and episodes since the last call, and return the mean objective of these episodes.

        The slots of a flock end together.
        """
        measured.environment_seconds = (measured.environment_seconds or 0.0) + self._seconds
        measured.episodes += len(self._objectives) // slots
        mean = fmean(self._objectives) if self._objectives else nan
        self._seconds, self._objectives = 0.0, []
        return mean
