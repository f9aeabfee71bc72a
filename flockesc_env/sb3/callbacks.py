"""``FlockEvalCallback``: plays tuning flocks while stable-baselines3 trains, and keeps the best model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv

from flockesc_env.common.checks import as_count, as_path
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.files import atomic_write
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, LINE_OBJECTIVES
from flockesc_env.episodes.splits import TUNING
from flockesc_env.policies.playing import play
from flockesc_env.policies.sb3 import SB3Policy
from flockesc_env.sb3.environments import BatchVecEnv


class FlockEvalCallback(BaseCallback):
    """Plays tuning flocks during ``learn``, logs their mean objective and keeps the best model.

    Stable-baselines3's ``EvalCallback`` and ``evaluate_policy`` count slots: with a slot per agent their
    default judges a few agents of one flock. This callback plays whole episodes of ``num_flocks`` flocks in
    each scenario of the training environment, with its options and the model's most likely actions. It does
    so before the first action, so that the untrained model counts, every ``eval_freq`` actions, and at the
    end. Training is the same with and without it.

    The logger, and thus TensorBoard, receives ``eval/min_mean_distance`` in m, or the column of the
    environment's other objective, and ``eval/episodes``, the number of episodes played so far.

    Args:
        eval_freq: number of calls of ``env.step`` between two evaluations, as for ``EvalCallback``.
        num_flocks: number of flocks per scenario. Their seeds are 1,000,000 and above, for tuning.
        best_model_save_path: folder for ``best_model.zip`` and, with a ``VecNormalize``, its statistics
            ``vecnormalize.pkl``. ``None``: no files.

    Attributes:
        best_objective: largest mean objective so far.
        num_episodes: number of episodes played so far.
        history: actions of training and mean objective of every evaluation.

    Raises:
        InputError: if an argument has the wrong type or value, or in ``learn`` if the training
            environment is neither one of ``vec_env`` nor a wrapped one.
    """

    def __init__(
        self, eval_freq: int, num_flocks: int = 20, *, best_model_save_path: str | Path | None = None
    ) -> None:
        super().__init__()
        self.eval_freq = as_count(eval_freq, "eval_freq")
        self.num_flocks = as_count(num_flocks, "num_flocks", most=len(TUNING))
        path = best_model_save_path
        self.best_model_save_path = None if path is None else as_path(path, "best_model_save_path")
        self.best_objective = -np.inf
        self.num_episodes = 0
        self.history: list[tuple[int, float]] = []

    def _on_training_start(self) -> None:
        env: Any = self.training_env.unwrapped
        arguments: dict[str, Any] = {"per_agent": False, "batch_size": 64, "num_threads": None}
        if isinstance(env, DummyVecEnv) and all(isinstance(one.unwrapped, LineEscapeEnv) for one in env.envs):
            env = env.envs[0].unwrapped
            self._played: Any = ([env.scenario], env.options, LINE_OBJECTIVES["escape_distance"], arguments)
        elif isinstance(env, BatchVecEnv):
            arguments["per_agent"] = env.policy_spec.per_agent
            arguments["predator_policy"] = env.predator_policy
            objective = FLOCK_OBJECTIVES[env.options.objective]
            self._played = (dict.fromkeys(env.scenarios), env.options, objective, arguments)
        else:
            raise InputError("model.env", "an environment of Task.vec_env", shown(self.training_env))
        self._evaluate()

    def _on_step(self) -> bool:
        if self.n_calls % self.eval_freq == 0:
            self._evaluate()
        return True

    def _on_training_end(self) -> None:
        self._evaluate()

    def _evaluate(self) -> None:
        scenarios, options, spec, arguments = self._played
        seeds = TUNING[: self.num_flocks]
        objectives = [
            play(SB3Policy(self.model), seeds, scenario, options, **arguments)[spec.name]
            for scenario in scenarios
        ]
        objective = float(np.mean(objectives))
        self.num_episodes += np.size(objectives)
        self.history.append((self.num_timesteps, objective))
        self.logger.record(f"eval/{spec.name}", objective)
        self.logger.record("eval/episodes", self.num_episodes)
        self.logger.dump(self.num_timesteps)
        if objective > self.best_objective:
            self.best_objective = objective
            if self.best_model_save_path is not None:
                self.best_model_save_path.mkdir(parents=True, exist_ok=True)
                with atomic_write(self.best_model_save_path / "best_model.zip") as file:
                    self.model.save(file)  # type: ignore[arg-type]
                normalizer = self.model.get_vec_normalize_env()
                if normalizer is not None:
                    normalizer.save(str(self.best_model_save_path / "vecnormalize.pkl"))
