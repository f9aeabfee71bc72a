"""Vectorized environments of stable-baselines3: a slot per flock, or a slot per agent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from flockesc_env.common.checks import as_array, as_seed
from flockesc_env.common.errors import ActionError
from flockesc_env.envs._restorable import RestorableBatch
from flockesc_env.episodes.batch import Columns, FlockBatch, Observations, infos
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.episodes.seeds import fresh_seed
from flockesc_env.render import RENDER_MODES, RenderOptions, flock_viewer, frames_per_second, render
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario


class _BatchVecEnv(RestorableBatch, VecEnv):
    """A batch of flocks with ``rows`` slots each; all slots of a flock share its episode.

    It is truncated at the horizon and terminated once nobody is left.
    """

    _per_agent: ClassVar[bool]

    def __init__(
        self,
        num_flocks: int,
        scenario: FlockScenario | str | None = None,
        *,
        render_mode: str | None = None,
        render_options: RenderOptions | None = None,
        num_threads: int | None = None,
        predator_policy: PredatorPolicy | None = None,
        **options: Any,
    ) -> None:
        self._batch = batch = FlockBatch(
            as_scenario(scenario, FlockScenario),
            EnvOptions(**options),
            num_flocks=num_flocks,
            per_agent=self._per_agent,
            num_threads=num_threads,
            predator_policy=predator_policy,
        )
        self.policy_spec = batch.policy_spec
        self.scenario = batch.scenario
        self.options = batch.options
        fps = frames_per_second(self.scenario.time_step * self.options.steps_per_action)
        self.render_mode = render_mode
        self._viewer = flock_viewer(batch, render_mode, render_options, fps)
        self._actions: NDArray[Any] | None = None
        slots = batch.num_flocks * batch.rows
        super().__init__(slots, batch.policy_spec.layout.space(), batch.policy_spec.actions.space())
        self.metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": fps}

    def reset(self) -> VecEnvObs:
        """Start an episode in every flock, with the seeds and options set since the last reset.

        ``set_options`` takes those of ``FlockEscapeEnv.reset``, for all slots or one dict per slot; the
        first slot of a flock speaks for it. With ``seed(s)`` and an ``episode`` for each flock a run that was
        stopped goes on.

        Raises:
            ArgumentError: naming a bad option; the running episodes go on.
        """
        rows, flocks = self._batch.rows, range(self._batch.num_flocks)
        seeds = self._seeds[::rows]
        if any(self._options):
            starts = [self._batch.start(options) for options in self._options[::rows]]
            parts = [self._batch.reset([flock], [seeds[flock]], starts[flock]) for flock in flocks]
            observations = np.concatenate([rows for rows, _ in parts])
            reset_infos = [info for _, columns in parts for info in self._slot_infos(columns, np.zeros(rows))]
        else:
            observations, columns = self._batch.reset(flocks, seeds)
            reset_infos = self._slot_infos(columns, np.zeros(self.num_envs))
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = reset_infos
        if self._viewer is not None:
            self._viewer.update()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the actions of the next step, shape (num_envs, 1) or, where discrete, (num_envs,)."""
        self._actions = as_array(actions, "action", ActionError).copy()  # the caller may reuse its array

    def step_wait(self) -> VecEnvStepReturn:
        """Step all flocks; a flock whose episode has ended is reset at once.

        Raises:
            ActionError: for an action outside of the action space.
            EpisodeError: before ``reset``.
        """
        observations, rewards, ended, ranges, columns = self._batch.step(self._actions)
        slot_infos = self._slot_infos(columns, ranges)
        dones = np.repeat(ended, self._batch.rows)
        if ended.any():
            self._restart(ended, dones, observations, slot_infos)
        if self._viewer is not None:
            self._viewer.update()
        return observations, rewards.astype(np.float32), dones, slot_infos

    def _restart(
        self,
        ended: NDArray[np.bool],
        dones: NDArray[np.bool],
        observations: Observations,
        slot_infos: list[dict[str, Any]],
    ) -> None:
        """Reset the flocks that have ended, and keep their last observations in their slots' infos."""
        is_gone = self._batch.caught() if self._per_agent else self._batch.caught().all(axis=1)
        goes_on = ~is_gone.ravel()  # but for the horizon, which alone is a truncation
        for slot, last in zip(np.flatnonzero(dones).tolist(), observations[dones], strict=True):
            slot_infos[slot]["TimeLimit.truncated"] = bool(goes_on[slot])
            slot_infos[slot]["terminal_observation"] = last
        observations[dones], _ = self._batch.reset(np.flatnonzero(ended).tolist())

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Give flock f the seed ``seed + f`` at the next reset; ``None``: seeds from the operating system."""
        rows = self._batch.rows
        first = fresh_seed() if seed is None else as_seed(seed)
        as_seed(first + self._batch.num_flocks - 1, "seed of the last flock")
        self._seeds = [first + slot // rows for slot in range(self.num_envs)]
        return self._seeds

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return a picture of every flock, shape (size, size, 3); none without a render mode."""
        return [] if self._viewer is None else self._viewer.images()

    def render(self, mode: str | None = None) -> np.ndarray | None:
        """Return all flocks in one picture or, in mode ``"human"``, show them."""
        if self.render_mode == "human" and mode in {None, "human"}:
            render(self._viewer)  # SB3 would ask every slot to show itself
            return None
        return super().render(mode)

    def close(self) -> None:
        """Close the window, if there is one; the batch goes with its last reference."""
        if self._viewer is not None:
            self._viewer.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute, which all slots share, once per slot asked for."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute; slots share it, so it is set for all or not at all.

        Raises:
            ValueError: if ``indices`` leaves slots out.
        """
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise ValueError(f"indices: expected all slots, which share {attr_name!r}, got {indices}")
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of this object once per slot asked for."""
        method = getattr(self, method_name)
        return [method(*method_args, **method_kwargs) for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:  # noqa: ARG002
        """Return False for every slot: there is no Gymnasium environment inside that could be wrapped."""
        return [False for _ in self._get_indices(indices)]

    def _slot_infos(self, columns: Columns, ranges: NDArray[np.float64]) -> list[dict[str, Any]]:
        own = {"interaction_range": 0.0, "TimeLimit.truncated": False}
        shared = [{**info, **own} for info in infos(columns)]
        slot_infos = [info.copy() for info in shared for _ in range(self._batch.rows)]
        for info, rho in zip(slot_infos, ranges.tolist(), strict=True):
            info["interaction_range"] = rho
        return slot_infos


class FlockVecEnv(_BatchVecEnv):
    """A slot per flock: one action sets the range of a whole flock.

    Args:
        num_flocks: number of flocks, and of slots.
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        render_mode: ``"rgb_array"``: ``render`` returns a picture of all flocks; ``"human"``: a window shows
            every reset and step.
        render_options: what pictures show.
        num_threads: threads over which flocks are spread; ``None``: one per core.
        predator_policy: steers the learned predators, for example ``Pursue()`` or a trained ``SB3Policy``;
            in a scenario without any, all predators become ``Learned``. ``None``: those fly straight on.
        **options: see ``EnvOptions``.

    Raises:
        ScenarioError: for an option out of bounds or a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    _per_agent = False


class AgentVecEnv(_BatchVecEnv):
    """A slot per agent: one policy, shared by all agents, sets the range of each.

    Slot ``f * num_agents + i`` is agent i of flock f. ``seed(s)`` gives flock f the seed ``s + f``.

    The number of slots is fixed, so that of an agent that was caught stays, as in SuperSuit's
    ``black_death``: until the episode of its flock ends it sees zeros, is paid 0, its action is ignored, and
    it is not done.

    Args:
        num_flocks: number of flocks; there are ``num_flocks * scenario.num_agents`` slots.
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        render_mode: ``"rgb_array"``: ``render`` returns a picture of all flocks; ``"human"``: a window shows
            every reset and step.
        render_options: what pictures show.
        num_threads: threads over which flocks are spread; ``None``: one per core.
        predator_policy: steers the learned predators, for example ``Pursue()`` or a trained ``SB3Policy``;
            in a scenario without any, all predators become ``Learned``. ``None``: those fly straight on.
        **options: see ``EnvOptions``.

    Raises:
        ScenarioError: for an option out of bounds or a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    _per_agent = True
