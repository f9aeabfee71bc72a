"""Vectorized environments and an evaluation callback for stable-baselines3."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from pathlib import Path
from typing import Any, ClassVar, Unpack, get_args

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import as_array, as_choice, as_count, as_path
from flockesc_env.common.errors import ActionError, ArgumentError, OptionError, shown
from flockesc_env.common.extras import require
from flockesc_env.envs import _autoreset
from flockesc_env.envs._base import FlockArguments, Infos, ManyFlocks, needs_reset_if_interrupted
from flockesc_env.episodes.batch import Columns
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.episodes.options import View
from flockesc_env.episodes.scenarios import Scenarios
from flockesc_env.episodes.seeds import consecutive_seeds, fresh_seed
from flockesc_env.policies.playing import play
from flockesc_env.policies.sb3 import SB3Policy
from flockesc_env.tasks.seeds import TUNING

require("sb3", ["stable_baselines3"])
from stable_baselines3.common.callbacks import BaseCallback  # noqa: E402, after the check
from stable_baselines3.common.vec_env import VecEnv  # noqa: E402
from stable_baselines3.common.vec_env.base_vec_env import (  # noqa: E402
    VecEnvIndices,
    VecEnvObs,
    VecEnvStepReturn,
)


class _BatchVecEnv(ManyFlocks, VecEnv):
    """Base class: a batch of flocks with one or more slots per flock, which share its episode.

    An episode terminates when all agents are caught and is truncated after ``scenario.num_steps`` model
    steps.
    """

    _view: ClassVar[View]

    def __init__(
        self,
        num_flocks: int,
        scenario: Scenarios | None = None,
        *,
        infos: Infos = "all",
        **arguments: Unpack[FlockArguments],
    ) -> None:
        super().__init__(scenario, arguments, num_flocks=num_flocks, view=self._view)
        self.policy_spec = spec = self._batch.policy_spec
        self._predator_policy = arguments.get("predator_policy")
        self._infos: Infos = as_choice(infos, "infos", get_args(Infos), OptionError)
        self._actions: NDArray[Any] | None = None
        kept = self.metadata, self.render_mode
        slots = self._batch.num_flocks * self._batch.rows
        VecEnv.__init__(self, slots, spec.layout.space(), spec.actions.space())
        self.metadata, self.render_mode = kept

    @needs_reset_if_interrupted
    def reset(self) -> VecEnvObs:
        """Start an episode in every flock, with the seeds and options that were set since the last reset.

        ``set_options`` takes the options of ``FlockEscapeEnv.reset``, for all slots or one dict per slot. The
        options of the first slot of each flock are used. To continue a run, call ``seed(s)`` and set the
        option ``episode``.

        Raises:
            ArgumentError: if an option is invalid; the running episodes continue.
        """
        rows, flocks = self._batch.rows, range(self._batch.num_flocks)
        starts = [self._batch.start(given, flock) for flock, given in enumerate(self._options[::rows])]
        observations, columns = self._batch.reset(flocks, self._seeds[::rows], starts)
        reset_infos = self._slot_infos(columns, np.zeros(self.num_envs))
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = reset_infos
        self._show()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Set the actions of the next step, shape (num_envs, 1) or, for discrete actions, (num_envs,)."""
        self._actions = as_array(actions, "action", ActionError).copy()  # the caller may reuse its array

    @needs_reset_if_interrupted
    def step_wait(self) -> VecEnvStepReturn:
        """Step all flocks; a flock whose episode ends starts the next one in the same step.

        Raises:
            ActionError: if the action is outside the action space.
            ResetNeededError: if called before ``reset``.
        """
        step = _autoreset.step(self._batch, self._actions, AutoresetMode.SAME_STEP)
        dones = step.terminations | step.truncations
        if self._infos == "all":
            slot_infos = self._slot_infos(step.columns, step.ranges)
        else:
            slot_infos = [{}] * self.num_envs
        if step.ending is not None:
            slots = np.flatnonzero(dones).tolist()
            if self._infos == "end":
                ended = {name: column[dones[:: self._batch.rows]] for name, column in step.columns.items()}
                for slot, info in zip(slots, self._slot_infos(ended, step.ranges[dones]), strict=True):
                    slot_infos[slot] = info
            for slot, last in zip(slots, step.ending.observations, strict=True):
                slot_infos[slot]["TimeLimit.truncated"] = bool(step.truncations[slot])
                slot_infos[slot]["terminal_observation"] = last
        self._show()
        return step.observations, step.rewards.astype(np.float32), dones, slot_infos

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Set the seed of flock f to ``seed + f`` for the next reset; ``None``: a random ``seed``."""
        seeds = consecutive_seeds(fresh_seed() if seed is None else seed, self._batch.num_flocks)
        self._seeds = [seeds[slot // self._batch.rows] for slot in range(self.num_envs)]
        return self._seeds

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return one image per flock, shape (size, size, 3); an empty list without a render mode."""
        return [] if self._viewer is None else self._viewer.images()

    def render(self, mode: str | None = None) -> np.ndarray | None:  # type: ignore[override]
        """Return all flocks in one image; in mode ``"human"`` show them."""
        if self.render_mode == "human" and mode in {None, "human"}:
            ManyFlocks.render(self)  # SB3 would render every slot
            return None
        return VecEnv.render(self, mode)

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return the value of an attribute once per slot in ``indices``; all slots share it."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute for all slots, which share it.

        Raises:
            ArgumentError: if ``indices`` does not include all slots.
        """
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise ArgumentError("indices", f"all slots, which share {attr_name!r}", indices)
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of this environment once per slot in ``indices``."""
        method = getattr(self, method_name)
        return [method(*method_args, **method_kwargs) for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:  # noqa: ARG002
        """Return False for every slot: slots are not wrapped Gymnasium environments."""
        return [False for _ in self._get_indices(indices)]

    def _slot_infos(self, columns: Columns, ranges: NDArray[np.float64]) -> list[dict[str, Any]]:
        not_truncated = np.zeros(len(ranges) // self._batch.rows, np.bool)
        return _core.infos({**columns, "TimeLimit.truncated": not_truncated}, ranges)


class FlockVecEnv(_BatchVecEnv):
    """Vectorized environment with one slot per flock: one action sets the range of the whole flock.

    Args:
        num_flocks: number of flocks, and of slots.
        scenario: the flock model's parameters, or a preset's name; default: the paper's. A list contains one
            scenario per flock (docs/environments.md, "Several scenarios").
        infos: which ``info`` dicts of ``step`` have entries. ``"all"``: all. ``"end"``: those of slots whose
            episode has ended in this step; the others share one new empty dict, which is faster.
        **arguments: see ``FlockArguments`` and ``EnvOptions``. ``render`` returns one image of all flocks.

    Raises:
        InputError: as ``FlockEscapeEnv``, and ``ScenarioError`` if scenarios of a list do not agree.
    """

    _view = View.FLOCK


class AgentVecEnv(_BatchVecEnv):
    """Vectorized environment with one slot per agent: one shared policy sets the range of each agent.

    Slot ``f * num_agents + i`` is agent i of flock f. ``seed(s)`` gives flock f the seed ``s + f``.

    A caught agent keeps its slot until the episode of its flock ends, as in SuperSuit's ``black_death``: its
    observation is zeros, its reward is 0, its action is ignored, and it is not done.

    Args:
        num_flocks: number of flocks; there are ``num_flocks * scenario.num_agents`` slots.
        scenario: see ``FlockVecEnv``.
        infos: see ``FlockVecEnv``.
        **arguments: see ``FlockVecEnv``.
    """

    _view = View.AGENT


class FlockEvalCallback(BaseCallback):
    """Plays tuning flocks during ``learn``, logs their mean objective and keeps the best model.

    Stable-baselines3's ``EvalCallback`` and ``evaluate_policy`` count slots: on ``AgentVecEnv`` their default
    judges a few agents of one flock. This callback plays whole episodes of ``num_flocks`` flocks in each
    scenario of the training environment, with its options and the model's most likely actions. It does so
    before the first action, so that the untrained model counts, every ``eval_freq`` actions, and at the end.
    Training is the same with and without it.

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

    Raises:
        ArgumentError: if an argument has the wrong type or value, or in ``learn`` if the training
            environment is not a ``FlockVecEnv`` or ``AgentVecEnv``, which may be wrapped.
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

    def _on_training_start(self) -> None:
        if not isinstance(self.training_env.unwrapped, _BatchVecEnv):
            raise ArgumentError("model.env", "a FlockVecEnv or AgentVecEnv", shown(self.training_env))
        self._evaluate()

    def _on_step(self) -> bool:
        if self.n_calls % self.eval_freq == 0:
            self._evaluate()
        return True

    def _on_training_end(self) -> None:
        self._evaluate()

    def _evaluate(self) -> None:
        env: Any = self.training_env.unwrapped
        spec = FLOCK_OBJECTIVES[env.options.objective]
        seeds = TUNING[: self.num_flocks]
        objectives = [
            play(
                SB3Policy(self.model),
                seeds,
                scenario,
                env.options,
                per_agent=env.policy_spec.per_agent,
                batch_size=64,
                num_threads=None,
                predator_policy=copy(env._predator_policy),
            )[spec.column]
            for scenario in dict.fromkeys(env.scenarios)
        ]
        objective = float(np.mean(objectives))
        self.num_episodes += np.size(objectives)
        self.logger.record(f"eval/{spec.column}", objective)
        self.logger.record("eval/episodes", self.num_episodes)
        self.logger.dump(self.num_timesteps)
        if objective > self.best_objective:
            self.best_objective = objective
            if self.best_model_save_path is not None:
                self.best_model_save_path.mkdir(parents=True, exist_ok=True)
                self.model.save(self.best_model_save_path / "best_model")
                normalizer = self.model.get_vec_normalize_env()
                if normalizer is not None:
                    normalizer.save(str(self.best_model_save_path / "vecnormalize.pkl"))
