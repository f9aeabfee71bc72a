"""Learners of stable-baselines3, trained round by round: killed and continued, a run ends as if left alone.

Every round draws from generators seeded for it and plays flocks of its own from their start: it depends on
networks, optimizers and the scale of rewards as the round before left them, and on nothing else.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger, configure
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecEnvWrapper, VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn
from torch import nn

from flockesc_env import Architecture, FlockScenario, LineEscapeEnv, LineScenario, NetworkPolicy
from flockesc_env.common.progress import progress_bar
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv
from training.config import PPOArgs, SB3Args, TQCArgs
from training.evaluation import policy_spec
from training.outputs import Measured, begin, finish, load_checkpoint, save_checkpoint
from training.seeds import training_seeds

LINE_ACTIONS = 64
"""Actions of a round on the line, where episodes last about 7 steps."""

A = TypeVar("A", PPOArgs, TQCArgs)


@dataclass
class RoundsState:
    """All that the next round depends on, and what was measured so far.

    Attributes:
        round: number of the next one.
        learned: networks, optimizers and what else the learner keeps.
        reward_scale: running variance of returns.
        measured: so far.
    """

    round: int
    learned: dict[str, Any]
    reward_scale: Any
    measured: Measured


class Rounds(ABC, Generic[A]):
    """A run of one algorithm of stable-baselines3.

    Attributes:
        args: of the run.
        model: of stable-baselines3.
        steps: actions of a round.
        done: rounds so far.
    """

    def __init__(self, args: A) -> None:
        training_seeds(args.seed, 0, args.num_flocks * args.num_episodes)  # refuses too many
        torch.set_num_threads(args.threads)
        self.args: A = args
        self.done = 0
        self._measured = Measured(environment_seconds=0.0)
        self._timed = Timed(_vec_env(args), args.num_flocks)
        self.steps = round_steps(args)
        # Observations are scaled already; returns are brought to unit scale for the value networks.
        self._env = VecNormalize(self._timed, norm_obs=False, gamma=args.gamma)
        self.model = self.make(self._env)

    @abstractmethod
    def make(self, env: VecEnv) -> BaseAlgorithm:
        """Make the model."""

    @abstractmethod
    def policy(self) -> NetworkPolicy:
        """Return the deterministic policy."""

    def learned(self) -> dict[str, Any]:
        """Return all that the next round takes over from this one, but for the scale of rewards."""
        return {"parameters": self.model.get_parameters(), "num_timesteps": self.model.num_timesteps}

    def relearn(self, learned: dict[str, Any]) -> None:
        """Take over what ``learned`` returned."""
        self.model.set_parameters(learned["parameters"])
        self.model.num_timesteps = learned["num_timesteps"]

    def train(self) -> Path:
        """Train, or go on with an unfinished run, and return the policy's file.

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
                if self.done % args.checkpoint_every == 0 or self.done == args.num_episodes:
                    self._measured.add_point(args, self.policy())
                    save_checkpoint(self._state(), args.run)
        return finish(args, self.policy(), self._measured)

    def _round(self) -> None:
        args, model, timed, measured = self.args, self.model, self._timed, self._measured
        begun, spent = time.process_time(), timed.seconds
        model.set_random_seed(int(np.random.SeedSequence([args.seed, self.done]).generate_state(1)[0]))
        self._env.seed(training_seeds(args.seed, self.done * args.num_flocks, args.num_flocks)[0])
        model.set_env(self._env)  # which lets it reset before the first step
        model.learn(
            self.steps * self._env.num_envs,
            callback=ObjectiveLog() if args.tensorboard else None,
            log_interval=1 if args.tensorboard else None,  # type: ignore[arg-type]
            reset_num_timesteps=False,
        )
        self.done += 1
        measured.seconds += time.process_time() - begun
        assert measured.environment_seconds is not None  # noqa: S101, a run measures it from the start
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
    """Measures the time spent in an environment, and counts the episodes that end.

    Attributes:
        seconds: so far.
    """

    def __init__(self, venv: VecEnv, num_flocks: int) -> None:
        super().__init__(venv)
        self.seconds = 0.0
        self._rows = venv.num_envs // num_flocks  # slots of a flock, which end together
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
        """Return how many episodes have ended since the last call."""
        ended, self._episodes = self._episodes, 0
        return ended


class ObjectiveLog(BaseCallback):
    """Logs the objectives that the flocks of a round reached."""

    def _on_step(self) -> bool:
        ended = {id(info): info for info in self.locals["infos"] if "terminal_observation" in info}
        for info in ended.values():
            for name in ("min_mean_distance", "min_min_distance", "escape_distance"):
                if name in info:
                    self.logger.record_mean(f"flock/{name}", info[name])
        return True


def round_steps(args: SB3Args) -> int:
    """Return the number of actions of a round."""
    model = args.model
    return LINE_ACTIONS if isinstance(model, LineScenario) else -(-model.num_steps // args.steps_per_action)


def network(args: SB3Args, layers: Iterable[nn.Module], **architecture: Any) -> NetworkPolicy:
    """Return the linear layers of a network of torch, with tanh between them, as a policy."""
    linear = [layer for layer in layers if isinstance(layer, nn.Linear)]
    with torch.no_grad():
        parts = [part.numpy().ravel() for layer in linear for part in (layer.weight.T, layer.bias)]
    names = policy_spec(args).layout.names
    return NetworkPolicy(Architecture(names, args.net_arch, **architecture), np.concatenate(parts))


def _vec_env(args: SB3Args) -> VecEnv:
    model, options = args.model, {**args.env_options(), "reward": args.reward}
    if isinstance(model, FlockScenario):
        make = AgentVecEnv if args.per_agent else FlockVecEnv
        return make(args.num_flocks, model, num_threads=args.threads, **options)
    return DummyVecEnv([partial(LineEscapeEnv, model, **options)] * args.num_flocks)
