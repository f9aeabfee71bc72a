"""Training with stable-baselines3 in rounds; an interrupted run can be continued with the same result.

Every round seeds the random generators and starts new flocks. It depends only on the networks, optimizers and
scale of rewards after the previous round. A checkpoint contains all of these.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, configure
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecEnvWrapper, VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from flockesc_env import (
    ArgumentError,
    FlockScenario,
    LineEscapeEnv,
    LineScenario,
    NetworkPolicy,
    SB3Policy,
)
from flockesc_env.common.progress import progress_bar
from flockesc_env.episodes.objectives import OBJECTIVES
from flockesc_env.episodes.spaces import RangeActions
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv
from training.config import PPOArgs, SB3Args, TQCArgs
from training.outputs import Measured, begin, finish, load_checkpoint, save_checkpoint
from training.seeds import training_seeds

LINE_ACTIONS = 64
"""Actions per round on the line, where episodes last about 7 steps."""

A = TypeVar("A", PPOArgs, TQCArgs)


@dataclass
class RoundsState:
    """Checkpoint of a run: the state that the next round depends on, and the measurements so far.

    Attributes:
        round: number of the next round.
        learned: networks, optimizers and other state of the learner.
        reward_scale: running variance of returns.
        measured: measurements so far.
    """

    round: int
    learned: dict[str, Any]
    reward_scale: Any
    measured: Measured


class Rounds(ABC, Generic[A]):
    """A run of one algorithm of stable-baselines3.

    Attributes:
        args: arguments of the run.
        model: the model of stable-baselines3.
        steps: number of actions per round.
        done: number of finished rounds.
    """

    def __init__(self, args: A) -> None:
        training_seeds(args.seed, 0, args.num_flocks * args.num_episodes)  # raises if there are too few seeds
        torch.set_num_threads(args.threads)
        self.args: A = args
        self.done = 0
        self._measured = Measured(environment_seconds=0.0)
        self._timed = Timed(_vec_env(args), args.num_flocks)
        self.steps = round_steps(args)
        # Observations are already scaled; rewards are scaled to unit variance of returns.
        self._env = VecNormalize(self._timed, norm_obs=False, gamma=args.gamma)
        self.model = self.make(self._env)

    @abstractmethod
    def make(self, env: VecEnv) -> BaseAlgorithm:
        """Return a new model."""

    def policy(self) -> NetworkPolicy:
        """Return the deterministic policy."""
        return SB3Policy(self.model).network()

    def learned(self) -> dict[str, Any]:
        """Return the state of the learner, except the scale of rewards."""
        return {"parameters": self.model.get_parameters(), "num_timesteps": self.model.num_timesteps}

    def relearn(self, learned: dict[str, Any]) -> None:
        """Restore the state that ``learned`` returned."""
        self.model.set_parameters(learned["parameters"])
        self.model.num_timesteps = learned["num_timesteps"]

    def train(self) -> Path:
        """Train, or continue an unfinished run, and return the path of the policy file.

        Raises:
            FileExistsError: if the folder holds a finished run, or a run with other arguments.
        """
        args = self.args
        begin(args)
        self._log()
        self._load()
        with progress_bar(f"Train {args.run.name}", args.num_episodes, always=args.progress) as report:
            while self.done < args.num_episodes:
                report(self.done, args.num_episodes)
                self._round()
                is_point = self.done % args.checkpoint_every == 0
                if is_point:
                    self._measured.add_point(args, self.policy())
                if is_point or self.done == args.num_episodes:
                    save_checkpoint(self._state(), args.run)
        if args.num_episodes % args.checkpoint_every:  # not in the checkpoint: a longer run lacks this point
            self._measured.add_point(args, self.policy())
        return finish(args, self.policy(), self._measured)

    def _round(self) -> None:
        args, model, timed, measured = self.args, self.model, self._timed, self._measured
        begun, spent = time.process_time(), timed.seconds
        model.set_random_seed(int(np.random.SeedSequence([args.seed, self.done]).generate_state(1)[0]))
        self._env.seed(training_seeds(args.seed, self.done * args.num_flocks, args.num_flocks)[0])
        model.set_env(self._env)  # makes the model reset it before the first step
        model.learn(
            self.steps * self._env.num_envs,
            callback=ObjectiveLog() if args.tensorboard else None,
            log_interval=1 if args.tensorboard else None,  # type: ignore[arg-type]
            reset_num_timesteps=False,
        )
        self.done += 1
        measured.seconds += time.process_time() - begun
        assert measured.environment_seconds is not None  # noqa: S101, for the type checker
        measured.environment_seconds += timed.seconds - spent
        measured.samples = model.num_timesteps
        measured.episodes += timed.take_episodes()

    def _state(self) -> RoundsState:
        return RoundsState(self.done, self.learned(), self._env.ret_rms, self._measured)

    def _load(self) -> None:
        state: RoundsState | None = load_checkpoint(self.args.run)
        if state is not None:
            self.done, self._measured, self._env.ret_rms = state.round, state.measured, state.reward_scale
            self.relearn(state.learned)

    def _log(self) -> None:
        folder = self.args.run / "tensorboard"
        self.model.set_logger(
            configure(str(folder), ["tensorboard"]) if self.args.tensorboard else Logger(None, [])
        )


class Timed(VecEnvWrapper):
    """Wrapper that measures the time spent in an environment and counts finished episodes.

    Attributes:
        seconds: processor time so far in s.
    """

    def __init__(self, venv: VecEnv, num_flocks: int) -> None:
        super().__init__(venv)
        self.seconds = 0.0
        self._rows = venv.num_envs // num_flocks  # slots per flock, whose episodes end together
        self._episodes = 0

    def reset(self) -> VecEnvObs:
        """Reset the environment."""
        begun = time.process_time()
        observations = self.venv.reset()
        self.seconds += time.process_time() - begun
        return observations

    def step_wait(self) -> VecEnvStepReturn:
        """Step the environment."""
        begun = time.process_time()
        result = self.venv.step_wait()
        self.seconds += time.process_time() - begun
        self._episodes += int(result[2].sum()) // self._rows
        return result

    def take_episodes(self) -> int:
        """Return the number of episodes that have ended since the last call."""
        ended, self._episodes = self._episodes, 0
        return ended


class RangeCost(VecEnvWrapper):
    """Wrapper that deducts the cost of a range from the reward of an action; see ``PPOArgs.range_cost``."""

    def __init__(self, venv: VecEnv, cost: float) -> None:
        super().__init__(venv)
        self._actions: RangeActions = venv.get_attr("policy_spec")[0].actions
        self._cost = cost / self._actions.max_range
        self._ranges = np.zeros(venv.num_envs)

    def reset(self) -> VecEnvObs:
        """Reset the environment."""
        return self.venv.reset()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Set the actions of the next step."""
        self._ranges = self._actions.to_ranges(actions, self.num_envs)
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Step the environment."""
        observations, rewards, dones, infos = self.venv.step_wait()
        return observations, (rewards - self._cost * self._ranges).astype(np.float32), dones, infos


class ObjectiveLog(BaseCallback):
    """Callback that logs the objectives of finished episodes to TensorBoard."""

    def _on_step(self) -> bool:
        ended = {id(info): info for info in self.locals["infos"] if "terminal_observation" in info}
        for info in ended.values():
            for spec in OBJECTIVES:
                if spec.column in info:
                    self.logger.record_mean(f"flock/{spec.column}", info[spec.column])
        return True


def round_steps(args: SB3Args) -> int:
    """Return the number of actions per round."""
    model = _model(args)
    return LINE_ACTIONS if isinstance(model, LineScenario) else -(-model.num_steps // args.steps_per_action)


def _model(args: SB3Args) -> FlockScenario | LineScenario:
    """Return the scenario of training.

    Raises:
        ArgumentError: if the policy sees the time and ``PPOArgs.episode_steps`` would change it.
    """
    model = args.model
    if isinstance(args, PPOArgs) and args.episode_steps and isinstance(model, FlockScenario):
        if "time" in args.inputs or not (args.inputs or args.candidate_inputs):
            given = args.inputs or "all entries"
            raise ArgumentError("inputs", "entries without time, because episode_steps is given", given)
        return model.replace(num_steps=args.episode_steps)
    return model


def _vec_env(args: SB3Args) -> VecEnv:
    model, options = _model(args), {**args.env_options(), "reward": args.reward}
    if isinstance(args, PPOArgs) and args.candidate_inputs:
        if not args.profile_ranges:
            raise ArgumentError("profile_ranges", "candidate ranges for a network that scores them", "none")
        options |= {"action_mode": "discrete", "range_grid": args.profile_ranges}
    if isinstance(args, PPOArgs) and args.ranges:
        options |= {"action_mode": "discrete", "range_grid": args.ranges}
    if isinstance(model, FlockScenario):
        make = AgentVecEnv if args.per_agent else FlockVecEnv
        env: VecEnv = make(args.num_flocks, model, num_threads=args.threads, **options)
    else:
        env = DummyVecEnv([partial(LineEscapeEnv, model, **options)] * args.num_flocks)
    return RangeCost(env, args.range_cost) if isinstance(args, PPOArgs) and args.range_cost else env
