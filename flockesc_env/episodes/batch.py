"""``FlockBatch``: many flocks stepped together, shared by all environments and rollouts."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_bytes, as_count, as_threads
from flockesc_env.common.errors import InputError, ResetNeededError
from flockesc_env.episodes.predators import PredatorPolicySpec, reset_policy
from flockesc_env.episodes.spaces import policy_spec
from flockesc_env.episodes.starts import as_start, distinct_scenarios, fresh_seed
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.options import EnvOptions

Observations = NDArray[np.float32]

Columns = dict[str, NDArray[Any]]
"""``info`` of several flocks, without ``interaction_range``: one array per key, one entry per flock."""

Step = tuple[Observations, FloatArray, NDArray[np.bool], FloatArray, Columns]
"""Observations (num_flocks * rows, entries), rewards (num_flocks * rows,), whether each flock's episode has
ended (num_flocks,), ranges in m (num_flocks * rows,), and columns of ``info``."""

AtEnd = Literal["refuse", "restart", "stay"]

MAX_FLOCKS: Final = 1_000_000
"""Largest number of flocks in a batch."""


class FlockBatch:
    """Episodes of many flocks, stepped together; slots do not influence each other.

    Args:
        scenario: the flock model's parameters, or a list with one scenario per slot. The scenarios of a list
            must agree in ``num_agents``, ``dimension``, ``initial_side``, the number of ``Learned`` predators
            and the unit of the range (m, or neighbors under a topological rule).
        options: options of actions, rewards and observations.
        num_flocks: number of slots.
        per_agent: True: a range and an observation row per agent. False: one per flock.
        num_threads, predator_policy: see ``FlockArguments``.
        max_actions: number of actions after which an episode is truncated; ``None``: no limit.

    Attributes:
        core: the batch in the compiled core.
        row_spec: what a row observes and sets.
    """

    flock_policy: Any = None
    """Sets the ranges of a ``PredatorBatch``."""
    hunt: FloatArray | None = None
    """The last actions of the predator policy."""

    def __init__(
        self,
        scenario: FlockScenario | Sequence[FlockScenario],
        options: EnvOptions,
        *,
        num_flocks: int = 1,
        per_agent: bool = False,
        num_threads: int | None = None,
        predator_policy: Any = None,
        max_actions: int | None = None,
    ) -> None:
        self.num_flocks = as_count(num_flocks, "num_flocks", most=MAX_FLOCKS)
        self._distinct, self._scenario_of_slot = distinct_scenarios(scenario, self.num_flocks)
        self.scenario = first = self._distinct[0]  # of the first slot
        num_steps = max(distinct.num_steps for distinct in self._distinct)
        self.predator_policy_spec = replace(PredatorPolicySpec.of(first), num_steps=num_steps)
        self.policy_spec = replace(policy_spec(first, options, per_agent=per_agent), num_steps=num_steps)
        if predator_policy is not None:
            if not self.predator_policy_spec.count:
                expected = "a scenario with a Learned predator; scenario.with_learned_predators() makes one"
                kinds = ", ".join(type(predator).__name__ for predator in first.predators)
                raise InputError("predator_policy", expected, kinds or "no predator")
            predator_policy.check_spec(self.predator_policy_spec)
            self.policy_spec = replace(self.policy_spec, opponent=predator_policy.name)
        self.predator_policy = predator_policy
        # Whether a slot's episode began after the last action of the policy that this batch follows.
        self._has_begun = np.zeros(self.num_flocks, np.bool)
        self.options, self.max_actions = options, max_actions
        threads = as_threads(num_threads)
        self.row_spec: Any = self.policy_spec
        self.rows = self.policy_spec.rows  # observation rows and ranges per flock: 1, or the number of agents
        can_be_caught = any(distinct.capture_radius is not None for distinct in self._distinct)
        self.rows_can_be_caught = self._has_caught = per_agent and can_be_caught
        self.core = _core.FlockBatch(
            [distinct.to_json() for distinct in self._distinct],
            self._scenario_of_slot,
            options.to_core(per_agent=per_agent, max_actions=max_actions),
            self.policy_spec.actions.core,
            threads,
            options.count_components,
            fresh_seed(),
        )

    @property
    def scenarios(self) -> list[FlockScenario]:
        """The scenario of every slot."""
        return [self._distinct[index] for index in self._scenario_of_slot]

    def reset(
        self,
        slots: Sequence[int],
        seeds: Sequence[int | None] | None = None,
        options: Sequence[Mapping[str, Any] | None] = (None,),
    ) -> tuple[Observations, Columns]:
        """Start episodes in some slots; return observations and columns of ``info`` of these slots.

        A seed begins a seed schedule (``episode_seed``); without one the slot continues its own. Seeds are
        one per slot; options of ``FlockEscapeEnv.reset`` also, or a single one for all.
        """
        pairs = zip(options, slots, strict=False)
        starts = [as_start(each, self._distinct[self._scenario_of_slot[slot]]) for each, slot in pairs]
        began = self.core.reset(slots, seeds or [None] * len(slots), starts)
        self._has_begun[slots] = True
        return began

    def step(
        self,
        actions: Any,
        *,
        at_end: AtEnd = "refuse",
        out: tuple[Observations, FloatArray] | None = None,
        predator_actions: FloatArray | None = None,
        are_ranges: bool = False,
    ) -> Step:
        """Apply one action in every slot.

        Args:
            actions: shape (num_flocks * rows, 1) or, for discrete actions, (num_flocks * rows,).
            at_end: what happens in a slot whose episode has ended. ``"refuse"``: the call raises. Otherwise
                the slot's action is ignored and its reward is 0, and the slot starts the next episode of its
                schedule (``"restart"``) or stays unchanged (``"stay"``).
            out: arrays that receive the observations and rewards; ``None``: new arrays.
            predator_actions: actions of the ``Learned`` predators, shape (num_flocks * predators, D);
                ``None``: the predator policy chooses them or, without a policy, they are 0.
            are_ranges: True: ``actions`` are valid ranges in m, shape (num_flocks * rows,).
        """
        rows, ranges = self.policy_spec.rows, actions
        if not are_ranges:
            ignored = self.core.caught().ravel() if self._has_caught else None
            if at_end != "refuse":
                ended = np.repeat(self.core.ended(), rows)
                ignored = ended if ignored is None else ended | ignored
            ranges = self.policy_spec.actions.to_ranges(actions, self.num_flocks * rows, ignored)
        restarted: list[int] = []
        if self.predator_policy is not None and at_end == "restart":
            restarted = np.flatnonzero(self.core.ended()).tolist()
        step = self.core.step(ranges, at_end, out, self._hunt(predator_actions))
        self._has_begun[restarted] = True
        observations, rewards, ended, columns = step
        return observations, rewards, ended, ranges, columns

    def step_one(self, action: Any) -> tuple[Observations, float, bool, dict[str, Any]]:
        """Step a batch that has a single row, faster than ``step``.

        Return the observation, shape (entries,), the reward, whether the episode has ended, and ``info``.
        """
        return self.core.step_one(self.policy_spec.actions.to_range(action), self._hunt(None))

    def observe(self, slots: Sequence[int]) -> Observations:
        """Return the current observations of some slots."""
        return self.core.observe(slots)

    def outcomes(self) -> Columns:
        """Return the outcomes of every slot, as in ``Episodes``, without ``mean_return``."""
        return {**self.core.metrics(), "num_components": self.core.num_components()}

    def drawn(self, slot: int) -> FlockScenario:
        """Return the scenario of the current episode in one slot, with the drawn values of random fields."""
        scenario = self._distinct[self._scenario_of_slot[slot]]
        return scenario.drawn(self.core.episode_seed(slot)) if scenario.randomization else scenario

    def get_state(self, slots: Any = None) -> bytes:
        """Return a snapshot of some slots as bytes."""
        return self.core.get_state(self._slots(slots))

    def set_state(self, state: Any, slots: Any = None) -> Sequence[int]:
        """Restore some slots from a snapshot and return their indices.

        A snapshot of one slot is copied to all ``slots``; ``None``: all.
        """
        chosen = self._slots(slots)
        for other in set(range(self.num_flocks)).difference(chosen):
            self.core.has_ended(other)  # raises if the slot was never reset
        self.core.set_state(chosen, as_bytes(state, "state"))
        return self.forget(chosen)  # a snapshot does not contain the memory of a predator policy

    def forget(self, slots: Sequence[int]) -> Sequence[int]:
        """Clear the policy's memory of some slots before its next action and return the slots."""
        self._has_begun[slots] = True
        return slots

    def _slots(self, slots: Any) -> list[int]:
        if slots is None:
            return list(range(self.num_flocks))
        is_one = not isinstance(slots, Iterable) or (isinstance(slots, np.ndarray) and slots.ndim == 0)
        given = [slots] if is_one else list(slots)
        if not given:
            raise InputError("flocks", "an index or indices", "none")
        most = self.num_flocks - 1
        return [as_count(slot, f"flocks[{place}]", least=0, most=most) for place, slot in enumerate(given)]

    def _hunt(self, given: FloatArray | None) -> FloatArray | Callable[[], FloatArray] | None:
        """Return the predators' actions or, with a policy, a function that the core calls for them.

        The core calls it after its checks, so that a refused step does not change the policy's memory.
        """
        return self._predator_actions if given is None and self.predator_policy is not None else given

    def _predator_actions(self) -> FloatArray:
        observations = self.core.observe(range(self.num_flocks), "predators")
        if self._has_begun.any():
            reset_policy(self.predator_policy, self._has_begun.repeat(self.predator_policy_spec.count))
            self._has_begun[:] = False
        actions = self.predator_policy.act(observations, self.predator_policy_spec)
        name = "actions of the predator policy"
        self.hunt = self.predator_policy_spec.plain(actions, len(observations), name)
        return self.hunt


class PredatorBatch(FlockBatch):
    """A batch whose rows are the ``Learned`` predators; ``flock_policy`` sets the ranges.

    Rows are ordered by flock. The reward of a predator is minus the mean reward of its flock.
    """

    def __init__(self, *arguments: Any, flock_policy: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.flock_policy, self._flock_rows = flock_policy, np.zeros((0, 0), np.float32)
        known: Any = {"options": self.options, "opponent": flock_policy.name}
        self.row_spec = replace(self.predator_policy_spec, **known)
        self.rows, self.rows_can_be_caught = self.row_spec.count, False

    def observe(self, slots: Sequence[int]) -> Observations:
        """Return the current observations of the predators of some slots."""
        return self.core.observe(slots, "predators")

    def reset(self, slots: Sequence[int], *arguments: Any) -> tuple[Observations, Columns]:
        """Start episodes in some slots as ``FlockBatch.reset``."""
        _, columns = super().reset(slots, *arguments)
        return self.observe(slots), columns

    def step(
        self,
        actions: Any,
        *,
        at_end: AtEnd = "refuse",
        out: tuple[Observations, FloatArray] | None = None,
        **__: Any,
    ) -> Step:
        """Apply one action of every predator as ``FlockBatch.step``; the returned ranges are not set."""
        ended, slots = self.core.ended(), range(self.num_flocks)
        if at_end == "refuse" and ended.any():
            message = f"step() called after the end of flock {ended.argmax()}'s episode; call reset()"
            raise ResetNeededError(message)
        ignored = ended.repeat(self.rows)
        hunt = self.row_spec.plain(actions, len(ignored), "action", ignored)
        if self._has_begun.any():
            self._flock_rows = self.core.observe(slots)
            reset_policy(self.flock_policy, self._has_begun.repeat(self.policy_spec.rows))
            self._has_begun[:] = False
        chosen = self.flock_policy.act(self._flock_rows, self.policy_spec)
        step = super().step(chosen, at_end=at_end, predator_actions=hunt)
        self._flock_rows, _, has_ended, _, columns = step
        self._has_begun |= ended
        observations = self.observe(slots)
        rewards = np.where(ended, 0.0, self.core.predator_rewards()).repeat(self.rows)
        if out is not None:
            out[0][:], out[1][:] = observations, rewards
            observations, rewards = out
        return observations, rewards, has_ended, np.zeros(len(ignored)), columns

    def step_one(self, action: Any) -> tuple[Observations, float, bool, dict[str, Any]]:
        """Step one predator of one flock as ``FlockBatch.step_one``."""
        rows, rewards, ended, _, columns = self.step(self.row_spec.plain(action, None, "action"))
        return rows[0], float(rewards[0]), bool(ended[0]), info_dicts(columns)[0]


def info_dicts(columns: Mapping[str, NDArray[Any]], ranges: FloatArray | None = None) -> list[dict[str, Any]]:
    """Return new ``info`` dicts: one per flock or, with ``ranges``, one per row, with its range in m."""
    names, rows = list(columns), zip(*(column.tolist() for column in columns.values()), strict=True)
    flocks = [dict(zip(names, row, strict=True)) for row in rows]
    if ranges is None:
        return flocks
    each = zip(flocks, ranges.reshape(len(flocks), -1), strict=True)
    return [info for flock, own in each for info in with_ranges(flock, own)]


def with_ranges(info: dict[str, Any], ranges: FloatArray) -> list[dict[str, Any]]:
    """Return a copy of an ``info`` dict for each range in m. To copy it is faster than to merge dicts."""
    info, infos = info.copy(), []
    for rho in ranges.tolist():
        info["interaction_range"] = rho
        infos.append(info.copy())
    return infos


def is_over(columns: Mapping[str, Any]) -> Any:
    """Return whether all agents of each flock are caught: then its episode terminates."""
    return columns["fraction_surviving"] == 0.0
