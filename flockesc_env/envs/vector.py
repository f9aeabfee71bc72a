"""Gymnasium's vector interface: many flocks in one batch, one range for each."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_choice, as_count, as_flag, as_mapping, as_seed
from flockesc_env.common.errors import ArgumentError, EpisodeError, shown
from flockesc_env.envs._restorable import RestorableBatch
from flockesc_env.episodes.batch import MAX_FLOCKS, AtEnd, Columns, FlockBatch, Observations, is_over
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.render import RENDER_MODES, RenderOptions, flock_viewer, frames_per_second, render
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer

VectorStep = tuple[Observations, FloatArray, NDArray[np.bool], NDArray[np.bool], dict[str, Any]]


class FlockVectorEnv(RestorableBatch, VectorEnv[Observations, NDArray[Any], NDArray[Any]]):
    """Many flocks under attack, ``flockesc/FlockEscape-v0`` by ``gymnasium.make_vec``; one range for each.

    It gives what ``SyncVectorEnv`` over ``FlockEscapeEnv`` gives, bit for bit, in one call of the core per
    step. The horizon, ``scenario.num_steps``, truncates; a flock of which nobody is left terminates.

    Args:
        num_envs: number of flocks.
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        autoreset_mode: what happens to a flock whose episode has ended, as the enum or its value
            (``"NextStep"``, ``"SameStep"``, ``"Disabled"``).
        copy: whether ``reset`` and ``step`` return new arrays; ``False``: observations and rewards are two
            arrays that the next call overwrites.
        max_episode_steps: as ``gymnasium.make_vec`` hands it on; the horizon is the scenario's ``num_steps``,
            which this may not cut short.
        render_mode: ``"rgb_array"``: ``render`` returns a picture per flock; ``"human"``: a window shows
            every reset and step.
        render_options: what pictures show.
        num_threads: threads over which flocks are spread; ``None``: one per core.
        predator_policy: steers the learned predators, for example ``Pursue()`` or a trained ``SB3Policy``;
            in a scenario without any, all predators become ``Learned``. ``None``: those fly straight on.
        **options: see ``EnvOptions``.

    Raises:
        ArgumentError: for another argument of a wrong type or value.
        ScenarioError: for an option out of bounds or a scenario without predator.
        DependencyNotInstalled: for a render mode without pygame.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 20}
    _viewer: FlockViewer | None = None  # Gymnasium closes what was refused, too

    def __init__(
        self,
        num_envs: int = 1,
        scenario: FlockScenario | str | None = None,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        render_options: RenderOptions | None = None,
        num_threads: int | None = None,
        predator_policy: PredatorPolicy | None = None,
        **options: Any,
    ) -> None:
        self.num_envs = as_count(num_envs, "num_envs", most=MAX_FLOCKS)
        self.autoreset_mode = _mode(autoreset_mode)
        self._batch = FlockBatch(
            as_scenario(scenario, FlockScenario),
            EnvOptions(**options),
            num_flocks=self.num_envs,
            num_threads=num_threads,
            predator_policy=predator_policy,
        )
        _check_limit(max_episode_steps, self._batch)
        self.policy_spec = self._batch.policy_spec
        self.scenario = self._batch.scenario
        self.options = self._batch.options
        self.single_observation_space = self.policy_spec.layout.space()
        self.single_action_space = self.policy_spec.actions.space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        entries = len(self.policy_spec.layout.names)
        self._out = (
            None
            if as_flag(copy, "copy")
            else (np.zeros((self.num_envs, entries), np.float32), np.zeros(self.num_envs))
        )
        self._is_started = False
        fps = frames_per_second(self.scenario.time_step * self.options.steps_per_action)
        self.metadata = {**deepcopy(self.metadata), "autoreset_mode": self.autoreset_mode, "render_fps": fps}
        self.render_mode = render_mode
        self._viewer = flock_viewer(self._batch, render_mode, render_options, fps)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Start an episode in every slot, or in some.

        Args:
            seed: slot i takes ``seed + i``, or entry i of a list; ``None``: it goes on with its schedule
                (``episode_seed``).
            options: those of the single environment, which hold for every slot that is reset, and
                ``reset_mask``, bool of shape (num_envs,): which slots; default: all.

        Raises:
            ArgumentError: naming a bad seed or option; the running episodes go on.
            EpisodeError: if the first reset leaves slots out.
        """
        given = dict(as_mapping(options))
        slots = self._slots(given.pop("reset_mask", None))
        seeds = self._seeds(seed)
        start = self._batch.start(given)
        if len(slots) < self.num_envs and not self._is_started:
            raise EpisodeError("options['reset_mask']", "all slots in the first reset", f"slots {slots}")
        super().reset(seed=seeds[0])
        observations, columns = self._batch.reset(slots, [seeds[slot] for slot in slots], start)
        self._is_started = True
        if self._viewer is not None:
            self._viewer.update()
        if len(slots) < self.num_envs:
            observations = self._batch.observe(range(self.num_envs))
        if self._out is not None:
            self._out[0][:] = observations
            observations = self._out[0]
        return observations, self._infos({**columns, "interaction_range": np.zeros(len(slots))}, slots)

    def step(self, actions: Any) -> VectorStep:
        """Hold the ranges that ``actions`` set for ``steps_per_action`` steps of the model.

        Raises:
            ActionError: for an action outside of the action space, save those of slots that are reset.
            EpisodeError: before ``reset``, or if autoreset is disabled and the episode in a slot has ended.
        """
        at_end: AtEnd = "restart" if self.autoreset_mode is AutoresetMode.NEXT_STEP else "refuse"
        observations, rewards, ended, ranges, columns = self._batch.step(
            actions, at_end=at_end, out=self._out
        )
        terminations = is_over(columns)
        truncations = ended & ~terminations
        columns["interaction_range"] = ranges
        infos = self._infos(columns, range(self.num_envs))
        if self.autoreset_mode is AutoresetMode.SAME_STEP and ended.any():
            self._restart(ended, observations, columns, infos)
        if self._viewer is not None:
            self._viewer.update()
        return observations, rewards, terminations, truncations, infos

    def set_state(self, state: bytes, flocks: Any = None) -> Observations:  # noqa: D102, inherited
        observations = super().set_state(state, flocks)
        self._is_started = True
        return observations

    def render(self) -> tuple[Any, ...] | None:
        """Return a picture per flock, shape (size, size, 3), or show them side by side in mode ``"human"``.

        Raises:
            EpisodeError: before ``reset``.
        """
        pictures = render(self._viewer)
        return None if pictures is None else tuple(pictures)

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002, Gymnasium's `close` calls it, once
        """Close the window, if there is one."""
        if self._viewer is not None:
            self._viewer.close()

    def _restart(
        self, ended: NDArray[np.bool], observations: Observations, columns: Columns, infos: dict[str, Any]
    ) -> None:
        """Start the next episode where one has ended, and keep what the last one ended with in ``infos``."""
        slots = np.flatnonzero(ended).tolist()
        last = np.full(self.num_envs, None, object)
        for slot in slots:
            last[slot] = observations[slot].copy()
        final = self._infos({name: column[slots] for name, column in columns.items()}, slots)
        infos |= {
            "final_obs": last,
            "_final_obs": ended.copy(),
            "final_info": final,
            "_final_info": ended.copy(),
        }
        observations[slots], started = self._batch.reset(slots)
        for name, column in columns.items():
            column[slots] = started.get(name, 0.0)

    def _infos(self, columns: Columns, slots: Sequence[int]) -> dict[str, Any]:
        """Return Gymnasium's ``infos`` of some slots: arrays over all slots, and masks of who has one."""
        if len(slots) < self.num_envs:
            mask = np.zeros(self.num_envs, np.bool)
            mask[slots] = True
            columns = {name: _scatter(column, mask) for name, column in columns.items()}
        else:
            mask = np.ones(self.num_envs, np.bool)
        infos: dict[str, Any] = {}
        for name, column in columns.items():
            infos[name], infos[f"_{name}"] = column, mask.copy()
        return infos

    def _slots(self, mask: Any) -> list[int]:
        if mask is None:
            return list(range(self.num_envs))
        expected = f"a bool array of shape ({self.num_envs},) that is true somewhere"
        is_mask = isinstance(mask, np.ndarray) and mask.dtype == np.bool and mask.shape == (self.num_envs,)
        if not (is_mask and mask.any()):
            raise ArgumentError("options['reset_mask']", expected, shown(mask))
        slots: list[int] = np.flatnonzero(mask).tolist()
        return slots

    def _seeds(self, seed: Any) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, list | tuple) or (isinstance(seed, np.ndarray) and seed.ndim):
            if len(seed) != self.num_envs:
                raise ArgumentError("seed", f"{self.num_envs} seeds", len(seed))
            return [None if one is None else as_seed(one, f"seed[{i}]") for i, one in enumerate(seed)]
        first = as_seed(seed)
        as_seed(first + self.num_envs - 1, "seed of the last slot")
        return range(first, first + self.num_envs)


def _mode(mode: Any) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    return AutoresetMode(as_choice(mode, "autoreset_mode", [known.value for known in AutoresetMode]))


def _check_limit(max_episode_steps: Any, batch: FlockBatch) -> None:
    actions = -(-batch.scenario.num_steps // batch.options.steps_per_action)
    if max_episode_steps is not None and as_count(max_episode_steps, "max_episode_steps") < actions:
        expected = f"None or at least {actions}: the scenario's num_steps are the horizon"
        raise ArgumentError("max_episode_steps", expected, max_episode_steps)


def _scatter(column: NDArray[Any], mask: NDArray[np.bool]) -> NDArray[Any]:
    """Return an array with ``column`` where ``mask`` is true, and zeros."""
    full = np.zeros(len(mask), column.dtype)
    full[mask] = column
    return full
