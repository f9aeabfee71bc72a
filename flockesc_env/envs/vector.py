"""Gymnasium vector environment of many flocks: one action per flock sets its interaction range."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_choice, as_count, as_flag, as_mapping, as_seed
from flockesc_env.common.errors import ArgumentError, ResetNeededError, shown
from flockesc_env.envs import _autoreset
from flockesc_env.envs._base import FlockArguments, ManyFlocks
from flockesc_env.episodes.batch import MAX_FLOCKS, Columns, FlockBatch, Observations
from flockesc_env.render import render
from flockesc_env.scenario.flock import FlockScenario

VectorStep = tuple[Observations, FloatArray, NDArray[np.bool], NDArray[np.bool], dict[str, Any]]


class FlockVectorEnv(ManyFlocks, VectorEnv[Observations, NDArray[Any], NDArray[Any]]):
    """Many flocks under attack, ``flockesc/FlockEscape-v0`` with ``gymnasium.make_vec``; one range per flock.

    It returns the same values as ``SyncVectorEnv`` over ``FlockEscapeEnv``, bit for bit, and is faster.
    An episode terminates when all agents are caught and is truncated after ``scenario.num_steps`` model
    steps.

    Args:
        num_envs: number of flocks.
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        autoreset_mode: what happens after the end of an episode, as the enum or its value (``"NextStep"``,
            ``"SameStep"``, ``"Disabled"``).
        copy: True: ``reset`` and ``step`` return new arrays. False: the next call overwrites the returned
            observations and rewards.
        max_episode_steps: passed by ``gymnasium.make_vec``. It must not be smaller than the number of actions
            of an episode, which ``scenario.num_steps`` determines.
        **arguments: see ``FlockArguments`` and ``EnvOptions``. ``render`` returns one image per flock.

    Raises:
        ArgumentError: if an argument has the wrong type or value.
        OptionError: if an option is unknown, missing or out of bounds.
        ScenarioError: if the scenario has no predator.
        DependencyNotInstalled: if ``render_mode`` is given and pygame is not installed.
    """

    def __init__(
        self,
        num_envs: int = 1,
        scenario: FlockScenario | str | None = None,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        max_episode_steps: int | None = None,
        **arguments: Unpack[FlockArguments],
    ) -> None:
        self.num_envs = as_count(num_envs, "num_envs", most=MAX_FLOCKS)
        self.autoreset_mode = _mode(autoreset_mode)
        super().__init__(scenario, arguments, num_flocks=self.num_envs)
        _check_limit(max_episode_steps, self._batch)
        self.policy_spec = self._batch.policy_spec
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
        self.metadata["autoreset_mode"] = self.autoreset_mode

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Start an episode in every slot, or in some.

        Args:
            seed: an integer: slot i gets the seed ``seed + i``. A list: slot i gets entry i. ``None``: the
                slot continues its seed schedule (``episode_seed``).
            options: the options of ``FlockEscapeEnv.reset``, applied to every slot that is reset, and
                ``reset_mask``, the slots to reset, bool of shape (num_envs,); default: all.

        Raises:
            ArgumentError: if a seed or an option is invalid; the running episodes continue.
            ResetNeededError: if the first reset does not include all slots.
        """
        given = dict(as_mapping(options))
        slots = self._slots(given.pop("reset_mask", None))
        seeds = self._seeds(seed)
        start = self._batch.start(given)
        if len(slots) < self.num_envs and not self._is_started:
            raise ResetNeededError("first reset() called with a reset_mask that leaves slots out")
        super().reset(seed=seeds[0])
        observations, columns = self._batch.reset(slots, [seeds[slot] for slot in slots], start)
        self._is_started = True
        self._show()
        if len(slots) < self.num_envs:
            observations = self._batch.observe(range(self.num_envs))
        if self._out is not None:
            self._out[0][:] = observations
            observations = self._out[0]
        return observations, self._infos({**columns, "interaction_range": np.zeros(len(slots))}, slots)

    def step(self, actions: Any) -> VectorStep:
        """Set the interaction range of every flock and run ``steps_per_action`` model steps.

        Args:
            actions: shape (num_envs, 1) or, if the action mode is ``"discrete"``, (num_envs,).

        Returns:
            Observations, shape (num_envs, entries), rewards, terminations and truncations, shape (num_envs,),
            and ``infos``.

        Raises:
            ActionError: if an action is outside the action space, except in slots that are reset.
            ResetNeededError: if called before ``reset``, or after the end of an episode if autoreset is
                disabled.
        """
        step = _autoreset.step(self._batch, actions, self.autoreset_mode, self._out)
        step.columns["interaction_range"] = step.ranges
        infos = self._infos(step.columns, range(self.num_envs))
        if step.ending is not None:
            self._add_final(step, step.ending, infos)
        self._show()
        truncations = step.ended & ~step.terminations
        return step.observations, step.rewards, step.terminations, truncations, infos

    def set_state(self, state: bytes, flocks: Any = None) -> Observations:  # noqa: D102, inherited
        observations = super().set_state(state, flocks)
        self._is_started = True
        return observations

    def render(self) -> tuple[Any, ...] | None:
        """Return one image per flock, shape (size, size, 3); in mode ``"human"`` show them side by side.

        Raises:
            ResetNeededError: if called before ``reset``.
        """
        pictures = render(self._viewer)
        return None if pictures is None else tuple(pictures)

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002, called by Gymnasium's `close`
        """Close the window if one is open."""
        if self._viewer is not None:
            self._viewer.close()

    def _add_final(
        self, step: _autoreset.VectorStep, ending: _autoreset.Ending, infos: dict[str, Any]
    ) -> None:
        """Add ``final_obs`` and ``final_info`` of ended episodes; the other infos describe the new ones."""
        slots = ending.slots
        ended = np.zeros(self.num_envs, np.bool)
        ended[slots] = True
        last = np.full(self.num_envs, None, object)
        for slot, observation in zip(slots, ending.observations, strict=True):
            last[slot] = observation
        final = self._infos({name: column[slots] for name, column in step.columns.items()}, slots)
        infos |= {
            "final_obs": last,
            "_final_obs": ended,
            "final_info": final,
            "_final_info": ended.copy(),
        }
        for name, column in step.columns.items():
            column[slots] = ending.started.get(name, 0.0)

    def _infos(self, columns: Columns, slots: Sequence[int]) -> dict[str, Any]:
        """Return the ``infos`` of some slots in Gymnasium's form: arrays over all slots, and masks."""
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
        expected = f"a bool array of shape ({self.num_envs},) with at least one True"
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
        expected = f"None or at least {actions}, the number of actions of an episode"
        raise ArgumentError("max_episode_steps", expected, max_episode_steps)


def _scatter(column: NDArray[Any], mask: NDArray[np.bool]) -> NDArray[Any]:
    """Return an array with the entries of ``column`` where ``mask`` is true, and zeros elsewhere."""
    full = np.zeros(len(mask), column.dtype)
    full[mask] = column
    return full
