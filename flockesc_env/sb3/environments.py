"""Vectorized environments for stable-baselines3, and a callback that plays tuning flocks while it trains."""

import pickle
from collections.abc import Sequence
from copy import copy
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, Unpack, cast, get_args

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import (
    DummyVecEnv,
    VecEnv,
    sync_envs_normalization,
    unwrap_vec_normalize,
)
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from flockesc_env.common.checks import as_array, as_choice, as_count, as_flag, as_path
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.files import write_together
from flockesc_env.common.progress import Progress
from flockesc_env.envs import _autoreset
from flockesc_env.envs._base import (
    FlockArguments,
    Infos,
    LineArguments,
    ManyFlocks,
    Registered,
    named_arguments,
    survives_interrupts,
)
from flockesc_env.envs.line import LineEscapeEnv
from flockesc_env.episodes.batch import Columns, info_dicts
from flockesc_env.episodes.splits import TUNING
from flockesc_env.episodes.starts import Scenarios, consecutive_seeds, fresh_seed
from flockesc_env.policies.base import AnyPolicy, Side
from flockesc_env.policies.rollout import play
from flockesc_env.policies.sb3 import STORED_SPEC, SB3Policy
from flockesc_env.policies.setup import Setup, flocks_of, setup
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import preset


def vec_env(
    scenario: Scenarios | LineScenario | None = None,
    num_flocks: int = 1,
    *,
    per_agent: bool | None = None,
    **options: Any,
) -> VecEnv:
    """Return an environment with one slot per flock, per agent or per line.

    Slots and episodes are those of ``BatchVectorEnv`` with automatic resets in the same step. ``seed(s)``
    gives flock f the seed ``s + f``. The slot of a caught agent is not done before the episode ends.

    Args:
        scenario: as for ``BatchVectorEnv``. A ``LineScenario``, or the name of one, makes lines.
        num_flocks: number of flocks, or of lines.
        per_agent: True: one slot per agent, for a shared policy that sets the range of each agent. False: one
            slot per flock, or line. With ``side="predator"``, as for ``PredatorEnv``.
        **options: for flocks those of ``FlockArguments`` and ``EnvOptions``, and ``infos``: which ``info``
            dicts of ``step`` have entries. ``"all"``: all. ``"end"``: those of slots whose episode has ended
            in this step; the others share one new empty dict, which is faster. ``render`` returns one image
            of all flocks. ``side="predator"``, with ``flock_policy``, has one slot per ``Learned`` predator.
            For lines those of ``LineArguments`` and ``LineOptions``.
    """
    model = preset(scenario) if isinstance(scenario, str) else scenario
    if not isinstance(model, LineScenario):
        return BatchVecEnv(model, num_flocks, per_agent=per_agent, **options)
    if per_agent is not None and as_flag(per_agent, "per_agent"):
        raise InputError("per_agent", "False, because all agents of a line have the same range", per_agent)
    model.env_options(options, LineArguments, named_arguments(vec_env))
    envs = DummyVecEnv([partial(LineEscapeEnv, model, **options)] * as_count(num_flocks, "num_flocks"))
    envs.set_attr("spec", gymnasium.spec("flockesc/LineEscape-v1"))
    return envs


class BatchVecEnv(Registered, ManyFlocks, VecEnv):
    """A batch of flocks with one or more slots per flock, which share its episode; see ``vec_env``."""

    def __init__(
        self,
        scenario: Scenarios | None = None,
        num_flocks: int = 1,
        *,
        per_agent: bool | None = None,
        infos: Infos = "all",
        side: Side = "flock",
        flock_policy: AnyPolicy = None,
        **arguments: Unpack[FlockArguments],
    ) -> None:
        playing: Any = {"per_agent": per_agent, "side": side, "flock_policy": flock_policy}
        super().__init__(scenario, arguments, num_flocks=num_flocks, **playing)
        self._infos: Infos = as_choice(infos, "infos", get_args(Infos))
        self._actions: NDArray[Any] | None = None
        self._returns: NDArray[np.float64] | None = None  # of `play_episodes`
        metadata, slots = self.metadata, self._batch.num_flocks * self._batch.rows
        VecEnv.__init__(self, slots, self.policy_spec.layout.space(), self.policy_spec.space())
        self.metadata = metadata
        kind = "FlockAgents" if self._batch.policy_spec.per_agent else "FlockEscape"
        kind = "Predator" if side == "predator" else kind
        self.spec = gymnasium.spec(f"flockesc/{kind}-v1")

    @survives_interrupts
    def reset(self) -> VecEnvObs:
        """Start an episode in every flock, with the seeds and options that were set since the last reset.

        ``set_options`` takes the options of ``FlockEscapeEnv.reset``, for all slots or one dict per slot. The
        options of the first slot of each flock are used. To continue a run at episode e, call ``seed(s)``
        and set the option ``episode`` to e.
        """
        rows, flocks = self._batch.rows, range(self._batch.num_flocks)
        observations, columns = self._batch.reset(flocks, self._seeds[::rows], self._options[::rows])
        reset_infos = self._slot_infos(columns, np.zeros(self.num_envs))
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = reset_infos
        self._show()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Set the actions of the next step, shape (num_envs, 1) or, for discrete actions, (num_envs,)."""
        self._actions = as_array(actions, "action").copy()  # the caller may reuse its array

    @survives_interrupts
    def step_wait(self) -> VecEnvStepReturn:
        """Step all flocks; a flock whose episode ends starts the next one in the same step."""
        has_all = self._infos == "all"
        if self._returns is not None:
            rows, rewards, _, ranges, columns = self._batch.step(self._actions, at_end="stay")
            self._returns += rewards.reshape(len(self._returns), -1).mean(axis=1)
            slot_infos = self._slot_infos(columns, ranges) if has_all else [{}] * self.num_envs
            return rows, rewards.astype(np.float32), np.zeros(self.num_envs, np.bool), slot_infos
        step = _autoreset.step(self._batch, self._actions, AutoresetMode.SAME_STEP)
        dones = step.terminations | step.truncations
        slot_infos = self._slot_infos(step.columns, step.ranges) if has_all else [{}] * self.num_envs
        if step.ending is not None:
            slots = np.flatnonzero(dones).tolist()
            ended = {name: column[dones[:: self._batch.rows]] for name, column in step.columns.items()}
            infos = self._slot_infos(ended, step.ranges[dones])
            for slot, info, last in zip(slots, infos, step.ending.observations, strict=True):
                info["TimeLimit.truncated"] = bool(step.truncations[slot])
                info["terminal_observation"] = last
                slot_infos[slot] = info
        self._show()
        return step.observations, step.rewards.astype(np.float32), dones, slot_infos

    def play_episodes(self, entry: Setup, seeds: Sequence[int], progress: Progress | None = None) -> Columns:
        """Play the model of ``entry`` in its ``env``, a wrapper of this environment; see ``play``.

        All flocks of a chunk start together and stay at their end, and no slot is done, so that no wrapper
        sees an automatic reset. A ``VecNormalize`` does not learn. A reset is needed afterwards.
        """
        env, size, policy = entry.env, self._batch.num_flocks, cast("SB3Policy", entry.policy)
        kept, parts = (self._seeds, self._options), []
        normalizer: Any = unwrap_vec_normalize(env)
        is_learning = normalizer is not None and normalizer.training
        try:
            if is_learning:
                normalizer.training = False
            for start in range(0, len(seeds), size):
                chunk = [*seeds[start : start + size]]
                padded = [*chunk, *chunk[-1:] * (size - len(chunk))]
                self._seeds = [seed for seed in padded for _ in range(self._batch.rows)]
                self._options, self._returns = [{}] * self.num_envs, np.zeros(size)
                observations, state, begins = env.reset(), None, np.ones(self.num_envs, np.bool)
                while not self._batch.core.ended().all():
                    actions, state = policy.model.predict(observations, state, begins, deterministic=True)
                    observations, begins = env.step(actions)[0], np.zeros(self.num_envs, np.bool)
                columns = {**self._batch.outcomes(), "mean_return": self._returns}
                parts.append({name: column[: len(chunk)] for name, column in columns.items()})
                if progress is not None:
                    progress(start + len(chunk), len(seeds))
        finally:
            if is_learning:
                normalizer.training = True
            self._returns, (self._seeds, self._options) = None, kept
            self._drop_episodes()
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

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
        """Set an attribute for all slots, which share it; ``indices`` must include all."""
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise InputError("indices", f"all slots, which share {attr_name!r}", indices)
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
        columns = {**columns, "TimeLimit.truncated": not_truncated}
        if self._batch.flock_policy is None:
            return info_dicts(columns, ranges)
        return info_dicts({name: column.repeat(self._batch.rows) for name, column in columns.items()})


class FlockEvalCallback(BaseCallback):
    """Plays tuning flocks during ``learn``, logs their mean objective and keeps the best model.

    Stable-baselines3's ``EvalCallback`` and ``evaluate_policy`` count slots: with a slot per agent their
    default judges a few agents of one flock. This callback plays whole episodes of ``num_flocks`` flocks in
    each scenario of the training environment, with its options and the model's most likely actions. It does
    so before the first action, so that the untrained model counts, every ``eval_freq`` actions, and at the
    end. Training is the same with and without it. Wrappers that change observations or actions, and models
    that need them, require an ``eval_env``. With ``side="predator"``, a smaller objective is better.

    The logger, and thus TensorBoard, receives ``eval/min_mean_distance`` in m, or the column of the
    environment's other objective, and ``eval/episodes``, the number of episodes played so far.

    Args:
        eval_freq: number of calls of ``env.step`` between two evaluations, as for ``EvalCallback``.
        num_flocks: number of flocks per scenario. Their seeds are 1,000,000 and above, for tuning.
        best_model_save_path: folder for ``best_model.zip`` and, with a ``VecNormalize``, its statistics
            ``vecnormalize.pkl``. Both are complete before they replace older ones, and an older model is
            removed first: a kill at that moment leaves ``best_model.new.zip`` and no ``best_model.zip``, not
            a model with other statistics. ``None``: no files. The model knows the scenario and the options,
            so that ``flockesc watch PPO:FOLDER`` plays it.
        eval_env: another environment, with the wrappers of the training, in which the model plays, as in
            ``rollout``. It receives the statistics of a ``VecNormalize``. ``None``: the options decide.

    Attributes:
        best_objective: largest mean objective so far, or the smallest one of predators.
        num_episodes: number of episodes played so far.
        history: actions of training and mean objective of every evaluation.

    Raises:
        InputError: in ``learn`` if the training environment is neither one of ``vec_env`` nor a wrapped one.
        OSError: in ``learn`` if files cannot be written; the older ones stay.
    """

    def __init__(
        self,
        eval_freq: int,
        num_flocks: int = 20,
        *,
        best_model_save_path: str | Path | None = None,
        eval_env: Any = None,
    ) -> None:
        super().__init__()
        self.eval_freq = as_count(eval_freq, "eval_freq")
        self.num_flocks = as_count(num_flocks, "num_flocks", most=len(TUNING))
        path = best_model_save_path
        self.best_model_save_path = None if path is None else as_path(path, "best_model_save_path")
        self.eval_env = eval_env if eval_env is None else flocks_of(eval_env, "eval_env") and eval_env
        self.best_objective = -np.inf
        self.num_episodes = 0
        self.history: list[tuple[int, float]] = []

    def _on_training_start(self) -> None:
        env: Any = self.training_env.unwrapped
        if self.eval_env is not None and self.eval_env.unwrapped is env:
            raise InputError("eval_env", "another environment than that of the training", shown(env))
        if isinstance(env, DummyVecEnv) and all(isinstance(one.unwrapped, LineEscapeEnv) for one in env.envs):
            env = env.envs[0].unwrapped
            self._scenarios, self._objective = [env.scenario], "escape_distance"
        elif isinstance(env, BatchVecEnv):
            self._scenarios, self._objective = [*dict.fromkeys(env.scenarios)], env.options.objective
        else:
            raise InputError("model.env", "an environment of Task.vec_env", shown(self.training_env))
        # A copy has its own memory: the training's episodes are still running.
        self._flock = copy(getattr(env, "flock_policy", None))
        self._hunter = copy(getattr(env, "predator_policy", None))
        setattr(self.model, STORED_SPEC, env.policy_spec)
        self._evaluate()

    def _on_step(self) -> bool:
        if self.n_calls % self.eval_freq == 0:
            self._evaluate()
        return True

    def _on_training_end(self) -> None:
        self._evaluate()

    def _evaluate(self) -> None:
        policy, seeds = SB3Policy(self.model), TUNING[: self.num_flocks]
        if self.eval_env is None:
            entries = [self._setup(policy, scenario) for scenario in self._scenarios]
        else:
            entries = [setup(policy, env=self.eval_env)]
            sync_envs_normalization(self.training_env, self.eval_env)
        objectives = [play(entry, seeds)[self._objective] for entry in entries]
        objective, is_first = float(np.mean(objectives)), not self.history
        self.num_episodes += np.size(objectives)
        self.history.append((self.num_timesteps, objective))
        self.logger.record(f"eval/{self._objective}", objective)
        self.logger.record("eval/episodes", self.num_episodes)
        self.logger.dump(self.num_timesteps)
        gain = objective - self.best_objective
        if is_first or (gain > 0 if self._flock is None else gain < 0):
            self._save()
            self.best_objective = objective

    def _setup(self, policy: SB3Policy, scenario: Any) -> Setup:
        if self._flock is None:
            return setup(policy, scenario, predator_policy=self._hunter)
        env: Any = self.training_env.unwrapped
        return Setup(self._flock, scenario, env.options, env._batch.policy_spec.per_agent, policy)

    def _save(self) -> None:
        if (folder := self.best_model_save_path) is None:
            return
        folder.mkdir(parents=True, exist_ok=True)
        self.model.save(packed := BytesIO())
        files = {folder / "best_model.zip": packed.getvalue()}
        if (normalizer := self.model.get_vec_normalize_env()) is not None:
            files[folder / "vecnormalize.pkl"] = pickle.dumps(normalizer)
        write_together(files)
