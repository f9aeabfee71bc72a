"""``Planner``: chooses the range of a flock by simulating what each range leads to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray, as_count, as_seed, as_vector
from flockesc_env.common.errors import InputError, ResetNeededError, shown
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.episodes.options import EnvOptionsDict, options_in
from flockesc_env.episodes.predators import PredatorPolicy
from flockesc_env.episodes.spaces import PolicySpec, RangeActions
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

_NUM_RANGES, _NUM_FUTURES = 15, 10


@dataclass(frozen=True, eq=False)
class Plan:
    """A choice of ``Planner``: the action for ``env.step``, its range in m and the objective at the end.

    The episode reaches at least this ``value`` if the planner goes on.
    """

    action: Any
    interaction_range: float
    value: float


@dataclass(frozen=True, eq=False)
class PlannedEpisode:
    """An episode that ``Planner.play`` ran: the objective at its end, and the choices in order.

    The values of ``plans`` never fall, and the last one is ``objective``.
    """

    objective: float
    plans: tuple[Plan, ...]


class Planner:
    """Chooses one range for the whole flock by simulating copies of it (branches) to the end of the episode.

    A branch holds one of ``ranges`` for ``steps`` model steps and then one of ``futures`` to the end, or one
    of ``futures`` from the start. The planner returns the first range of the branch with the largest
    objective. Call it again after ``steps`` steps. The episode then reaches at least the value of every
    earlier choice, and so at least the objective of every constant range among ``futures``.

    A planner is not a ``Policy``: it reads the whole state and knows the future. In a random scenario it also
    knows the random numbers of the rest of the episode, because a snapshot contains them.

    Args:
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        ranges: ranges in m to choose from; ``None``: 15 ranges from ``min_range`` to ``max_range``, denser
            at short ranges.
        futures: ranges in m. After its first range, a branch holds one of them. ``None``: 10 of ``ranges``,
            evenly spread, or all if they are fewer.
        steps: number of model steps for which a branch holds its first range; a multiple of
            ``steps_per_action``.
        num_threads: number of threads; ``None``: one per core. Results do not depend on it.
        predator_policy: controls the ``Learned`` predators. It must be the environment's policy, and it may
            not have a memory (a method ``reset``), which a snapshot does not contain.
        **options: those of the environment, see ``EnvOptions``. The option ``objective`` says what is
            planned for.

    Attributes:
        ranges: the ranges of ``ranges`` after the rounding of the environment's actions, shape (k,).
        futures: the same for ``futures``.

    Raises:
        InputError: if an argument has the wrong type or value, or a scenario with ``Learned`` predators has
            no ``predator_policy``; if an option is unknown, missing or out of bounds, or the reward needs one
            range per agent; if the scenario has no predator.
    """

    def __init__(
        self,
        scenario: FlockScenario | str | None = None,
        *,
        ranges: ArrayLike | None = None,
        futures: ArrayLike | None = None,
        steps: int = 12,
        num_threads: int | None = None,
        predator_policy: PredatorPolicy | None = None,
        **options: Unpack[EnvOptionsDict],
    ) -> None:
        self.scenario = as_scenario(scenario, FlockScenario)
        self.options = options_in(self.scenario, options)
        if predator_policy is None and self.scenario.num_learned:
            raise InputError("predator_policy", "a policy for the Learned predators", "None")
        if hasattr(predator_policy, "reset"):
            expected = "a policy without a memory (a method reset)"
            raise InputError("predator_policy", expected, shown(predator_policy))
        self.steps = as_count(steps, "steps")
        self._num_actions, rest = divmod(self.steps, self.options.steps_per_action)
        if rest:
            expected = f"a multiple of steps_per_action = {self.options.steps_per_action}"
            raise InputError("steps", expected, self.steps)
        shared: Any = {"num_threads": num_threads, "predator_policy": predator_policy}
        self._batch = partial(FlockBatch, self.scenario, self.options, **shared)
        actions = self._batch().policy_spec.actions
        if ranges is None:
            parts = np.linspace(0, 1, _NUM_RANGES)
            ranges = actions.min_range + parts * parts * (actions.max_range - actions.min_range)
            ranges = np.minimum(ranges, actions.max_range)  # the last one may be rounded up
        chosen = _ranges(ranges, "ranges", actions)
        if futures is None:
            count = min(_NUM_FUTURES, len(chosen))
            futures = chosen[np.rint(np.linspace(0, len(chosen) - 1, count)).astype(int)]
        # Branches use actions of the environment, whose ranges may be rounded, so that values are exact.
        self._actions = actions.from_ranges(chosen)
        self._futures = actions.from_ranges(_ranges(futures, "futures", actions))
        self.ranges: FloatArray = actions.to_ranges(self._actions, len(self._actions))
        self.futures: FloatArray = actions.to_ranges(self._futures, len(self._futures))

    def plan(self, flock: Any) -> Plan:
        """Return the best choice for a flock in its current state; the flock stays unchanged.

        Args:
            flock: a ``FlockEscapeEnv``, which may be wrapped, or a snapshot from its ``get_state``. It must
                have the scenario and options of the planner.

        Raises:
            InputError: if ``flock`` is neither, sets one range per agent, holds several flocks, or has
                another scenario or other options.
            ResetNeededError: if the environment was never reset, or the episode has ended.
        """
        one = self._batch()
        one.set_state(_snapshot(flock))
        if one.core.has_ended(0):
            raise ResetNeededError("plan() called after the end of the episode; call reset()")
        return self._plan(one)

    def play(self, seed: int) -> PlannedEpisode:
        """Play the flock of a seed to the end, with a new choice every ``steps`` model steps.

        ``env.reset(seed=seed)`` starts the same flock.

        Raises:
            InputError: if ``seed`` is not an integer in [0, 2^64).
        """
        one = self._batch()
        one.reset([0], [as_seed(seed)])
        plans = []
        while not one.core.has_ended(0):
            plans.append(self._plan(one))
            self._hold(one, np.asarray(plans[-1].action)[np.newaxis])
        return PlannedEpisode(float(self._objective(one)[0]), tuple(plans))

    def _plan(self, one: FlockBatch) -> Plan:
        """Return the best choice for the flock in slot 0."""
        branches = self._copies(one, np.zeros(len(self._futures), int))
        while not self._hold(branches, self._futures):
            pass
        values = self._objective(branches)
        winner = int(values.argmax())
        constant = Plan(self._futures[winner], float(self.futures[winner]), float(values[winner]))
        if constant.value >= self._objective(one)[0]:
            return constant  # no branch can be better, because the objective never rises
        return self._better(one, constant.value) or constant

    def _better(self, one: FlockBatch, value: float) -> Plan | None:
        """Return the best branch of the flock in slot 0 if its objective is above ``value``.

        A branch is dropped when its objective so far is not above ``value``, because it never rises again.
        """
        branches = self._copies(one, np.zeros(len(self._actions), int))
        self._hold(branches, self._actions)
        slots = np.flatnonzero(self._objective(branches) > value)
        if not len(slots):
            return None
        first = np.repeat(slots, len(self._futures))
        future = np.tile(np.arange(len(self._futures)), len(slots))
        branches = self._copies(branches, first)
        has_ended = False
        while not has_ended:
            has_ended = self._hold(branches, self._futures[future])
            values = self._objective(branches)
            slots = np.flatnonzero(values > value)
            if not len(slots):
                return None
            if not has_ended and 2 * len(slots) < branches.num_flocks:
                branches, first, future = self._copies(branches, slots), first[slots], future[slots]
        winner = int(values.argmax())
        choice = first[winner]
        return Plan(self._actions[choice], float(self.ranges[choice]), float(values[winner]))

    def _hold(self, branches: FlockBatch, actions: NDArray[Any]) -> bool:
        """Hold the actions for ``steps`` model steps; return whether all episodes have ended."""
        for _ in range(self._num_actions):
            _, _, has_ended, _, _ = branches.step(actions, at_end="stay")
            if has_ended.all():
                return True
        return False

    def _objective(self, branches: FlockBatch) -> FloatArray:
        """Return the objective so far, shape (branches,). It never rises during an episode."""
        values: FloatArray = branches.core.metrics()[FLOCK_OBJECTIVES[self.options.objective].name]
        return values

    def _copies(self, source: FlockBatch, slots: NDArray[np.int64]) -> FlockBatch:
        """Return a batch with a copy of each of the ``slots``, which may repeat."""
        copies = self._batch(num_flocks=len(slots))
        copies.set_state(source.get_state(slots.tolist()))
        return copies


def _ranges(values: ArrayLike, name: str, actions: RangeActions) -> FloatArray:
    ranges = as_vector(values, name)
    if ranges.min() < actions.min_range or ranges.max() > actions.max_range:
        expected = f"ranges from {actions.min_range} to {actions.max_range}"
        raise InputError(name, expected, shown(ranges.tolist()))
    return ranges


def _snapshot(flock: Any) -> bytes:
    """Return the snapshot of an environment, or ``flock`` if it is a snapshot."""
    if isinstance(flock, bytes | bytearray | memoryview):
        return bytes(flock)
    inner = getattr(flock, "unwrapped", flock)
    spec = getattr(inner, "policy_spec", None)
    if not isinstance(spec, PolicySpec):
        raise InputError("flock", "a FlockEscapeEnv or its snapshot", shown(flock))
    if spec.per_agent:
        raise InputError("flock", "an environment with one range for the flock", "one range per agent")
    state: bytes = inner.get_state()
    return state
