"""Gymnasium vector environments of many flocks: one slot per flock, or one slot per agent."""

from collections.abc import Sequence
from typing import Any, Unpack, get_args

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from flockesc_env.common.checks import (
    FloatArray,
    as_array,
    as_choice,
    as_count,
    as_flag,
    as_integer,
    as_mapping,
    as_seed,
)
from flockesc_env.common.errors import InputError, ResetNeededError, shown
from flockesc_env.envs import _autoreset
from flockesc_env.envs._base import FlockArguments, ManyFlocks, Registered, survives_interrupts
from flockesc_env.episodes.batch import MAX_FLOCKS, Columns, Observations
from flockesc_env.episodes.starts import Scenarios, as_scenarios, consecutive_seeds
from flockesc_env.policies.base import AnyPolicy, Side
from flockesc_env.scenario.flock import FlockScenario

VectorStep = tuple[Observations, FloatArray, NDArray[np.bool], NDArray[np.bool], dict[str, Any]]


class BatchVectorEnv(Registered, ManyFlocks, VectorEnv[Observations, NDArray[Any], NDArray[Any]]):
    """Many flocks under attack with ``gymnasium.make_vec``: one slot per flock, or one slot per agent.

    ``flockesc/FlockEscape-v1`` has one slot, and one range, per flock. It returns the same values as
    ``SyncVectorEnv`` over ``FlockEscapeEnv``, bit for bit, and is faster.

    ``flockesc/FlockAgents-v1`` has ``per_agent=True``: slot ``f * num_agents + i`` is agent i of flock f, and
    one shared policy sets the range of each agent. It returns the same values as ``parallel_env``, bit for
    bit. ``reset(seed=s)`` gives flock f the seed ``s + f``. The slots of a flock start and end an episode
    together. A caught agent keeps its slot until then, as in SuperSuit's ``black_death``: its observation is
    zeros, its reward is 0, and its action is ignored. At the end of the episode its slot terminates and the
    others are truncated. If a scenario has a ``capture_radius``, ``infos["active"]`` is the mask of the
    agents that are not caught.

    An episode terminates when all agents are caught and is truncated after ``scenario.num_steps`` model
    steps.

    Args:
        num_envs: number of slots, with ``per_agent`` a multiple of ``scenario.num_agents``; ``None``: those
            of one flock, or of one flock per scenario of a list.
        scenario: the flock model's parameters, or a preset's name; default: the paper's. A list contains one
            scenario per flock (docs/environments.md, "Several scenarios").
        per_agent: True: one slot per agent. False: one slot per flock. With ``side="predator"``, which view
            the flock policy has, as for ``PredatorEnv``.
        side: ``"predator"``: one slot per ``Learned`` predator, as ``flockesc/Predator-v1`` has. Slots of one
            predator return the same values as ``SyncVectorEnv`` over ``PredatorEnv``, bit for bit.
        flock_policy: with ``side="predator"``, sets the ranges; see ``PredatorEnv``.
        autoreset_mode: what happens after the end of an episode, as the enum or its value (``"NextStep"``,
            ``"SameStep"``, ``"Disabled"``).
        copy: True: ``reset`` and ``step`` return new arrays. False: the next call overwrites the returned
            observations and rewards.
        max_episode_steps: number of actions after which an episode is truncated, as by ``TimeLimit``;
            ``None`` or -1: only ``scenario.num_steps`` limits it.
        **arguments: see ``FlockArguments`` and ``EnvOptions``. ``render`` returns one image per flock.
    """

    def __init__(
        self,
        num_envs: int | None = None,
        scenario: Scenarios | None = None,
        *,
        per_agent: bool | None = None,
        side: Side = "flock",
        flock_policy: AnyPolicy = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        max_episode_steps: int | None = None,
        **arguments: Unpack[FlockArguments],
    ) -> None:
        mode = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        modes = [known.value for known in AutoresetMode]
        self.autoreset_mode = AutoresetMode(as_choice(mode, "autoreset_mode", modes))
        given = as_scenarios(scenario)
        scenarios = [given] if isinstance(given, FlockScenario) else given
        rows, of = 1, "scenario.num_agents"
        if as_choice(side, "side", get_args(Side)) == "predator":
            rows, of = scenarios[0].num_learned or len(scenarios[0].predators), "the number of predators"
        elif per_agent is not None and as_flag(per_agent, "per_agent"):
            rows = scenarios[0].num_agents
        slots = len(scenarios) * rows
        if num_envs is not None:
            slots = as_count(num_envs, "num_envs", most=MAX_FLOCKS * rows)
        if slots % rows:
            raise InputError("num_envs", f"a multiple of {of} = {rows}", slots)
        limit = None
        if max_episode_steps is not None and as_integer(max_episode_steps, "max_episode_steps") != -1:
            limit = as_count(max_episode_steps, "max_episode_steps")
        playing: Any = {"num_flocks": slots // rows, "max_actions": limit, "side": side}
        super().__init__(given, arguments, per_agent=per_agent, flock_policy=flock_policy, **playing)
        self.num_envs = slots
        self.single_observation_space = self.policy_spec.layout.space()
        self.single_action_space = self.policy_spec.space()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        entries = len(self.policy_spec.layout.names)
        out = np.zeros((slots, entries), np.float32), np.zeros(slots)
        self._out = None if as_flag(copy, "copy") else out  # reused by every call
        self.metadata["autoreset_mode"] = self.autoreset_mode

    @survives_interrupts
    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start an episode in every flock, or in some.

        Args:
            seed: an integer: flock i gets the seed ``seed + i``. A list: flock i gets entry i. ``None``: the
                flock continues its seed schedule (``episode_seed``).
            options: the options of ``FlockEscapeEnv.reset``, applied to every flock that is reset, and
                ``reset_mask``, the slots to reset, bool of shape (num_envs,); default: all. The slots of a
                flock are reset together, and the first reset includes all.
        """
        given = dict(as_mapping(options))
        mask = self._mask(given.pop("reset_mask", None))
        flocks = np.flatnonzero(mask[:: self._batch.rows]).tolist()
        seeds = self._seeds(seed)
        is_partial = len(flocks) < self._batch.num_flocks
        if is_partial:
            try:
                self._batch.core.ended()
            except ResetNeededError:
                message = "first reset() called with a reset_mask that leaves slots out"
                raise ResetNeededError(message) from None
        observations, columns = self._batch.reset(flocks, [seeds[flock] for flock in flocks], [given])
        super().reset(seed=seeds[0])
        self._show()
        if is_partial:
            observations = self._batch.observe(range(self._batch.num_flocks))
        if self._out is not None:
            self._out[0][:] = observations
            observations = self._out[0].view()
        return observations, self._infos(self._started(columns), mask)

    @survives_interrupts
    def step(self, actions: Any) -> VectorStep:
        """Set the interaction range of every slot and run ``steps_per_action`` model steps.

        Args:
            actions: shape (num_envs, 1) or, if the action mode is ``"discrete"``, (num_envs,). Those of slots
                that are reset are ignored.

        Returns:
            Observations, shape (num_envs, entries), rewards, terminations and truncations, shape (num_envs,),
            and ``infos``.
        """
        step = _autoreset.step(self._batch, actions, self.autoreset_mode, self._out)
        columns = self._columns(step.columns, step.ranges, step.active)
        infos = self._infos(columns, np.ones(self.num_envs, np.bool))
        if step.ending is not None:
            self._add_final(columns, step.ending, infos)
        self._show()
        observations, rewards = step.observations, step.rewards
        if self._out is not None:  # A caller may lock or reshape what it gets, so it gets views.
            observations, rewards = observations.view(), rewards.view()
        return observations, rewards, step.terminations, step.truncations, infos

    close = VectorEnv.close  # calls `close_extras` once

    def close_extras(self, **kwargs: Any) -> None:  # noqa: ARG002
        """Close the window if one is open."""
        ManyFlocks.close(self)

    def _num_actions(self) -> int:
        actions, limit = super()._num_actions(), self._batch.max_actions
        return actions if limit is None else min(actions, limit)

    def _add_final(self, columns: Columns, ending: _autoreset.Ending, infos: dict[str, Any]) -> None:
        """Add ``final_obs`` and ``final_info`` of ended episodes. Other infos describe the new episodes."""
        ended = ending.rows
        last = np.full(self.num_envs, None, object)
        for slot, observation in zip(np.flatnonzero(ended).tolist(), ending.observations, strict=True):
            last[slot] = observation
        final = self._infos({name: column[ended] for name, column in columns.items()}, ended)
        infos |= {"final_obs": last, "_final_obs": ended, "final_info": final, "_final_info": ended.copy()}
        for name, column in self._started(ending.started).items():
            columns[name][ended] = column

    def _started(self, columns: Columns) -> Columns:
        """Return the columns over slots of flocks whose episodes have just started."""
        count = len(columns["mean_distance"]) * self._batch.rows
        return self._columns(columns, np.zeros(count), np.ones(count, np.bool))

    def _columns(self, columns: Columns, ranges: FloatArray, active: NDArray[np.bool] | None) -> Columns:
        """Return columns over slots, from columns over flocks and ranges and activity of slots."""
        rows = self._batch.rows
        slots = dict(columns) if rows == 1 else {name: each.repeat(rows) for name, each in columns.items()}
        if self._batch.flock_policy is None:
            slots["interaction_range"] = ranges
        if self._batch.rows_can_be_caught and active is not None:
            slots["active"] = active
        return slots

    def _infos(self, columns: Columns, mask: NDArray[np.bool]) -> dict[str, Any]:
        """Return the ``infos`` of the slots in ``mask`` in Gymnasium's form: arrays over all slots, masks."""
        infos: dict[str, Any] = {}
        for name, column in columns.items():
            infos[name] = column
            if len(column) < len(mask):
                infos[name] = np.zeros(len(mask), column.dtype)
                infos[name][mask] = column
            infos[f"_{name}"] = mask.copy()
        return infos

    def _mask(self, mask: Any) -> NDArray[np.bool]:
        if mask is None:
            return np.ones(self.num_envs, np.bool)
        field, shape = "options['reset_mask']", (self.num_envs,)
        is_mask = (
            isinstance(mask, np.ndarray) and as_array(mask, field).dtype == np.bool and mask.shape == shape
        )
        if not (is_mask and mask.any()):
            raise InputError(field, f"a bool array of shape {shape} with at least one True", shown(mask))
        flocks: NDArray[np.bool] = mask.reshape(-1, self._batch.rows)
        if (flocks != flocks[:, :1]).any():
            expected = f"equal entries for all {self._batch.rows} slots of a flock"
            raise InputError(field, expected, "different ones")
        return flocks.ravel()

    def _seeds(self, seed: Any) -> Sequence[int | None]:
        count = self._batch.num_flocks
        if seed is None:
            return [None] * count
        if isinstance(seed, list | tuple) or (isinstance(seed, np.ndarray) and seed.ndim):
            if len(seed) != count:
                raise InputError("seed", f"{count} seeds, one per flock", len(seed))
            return [None if one is None else as_seed(one, f"seed[{i}]") for i, one in enumerate(seed)]
        return consecutive_seeds(seed, count)
