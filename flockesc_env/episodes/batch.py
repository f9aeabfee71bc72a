"""The batch of flocks that every environment and rollout steps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import (
    FloatArray,
    as_bytes,
    as_count,
    as_flag,
    as_floats,
    as_options,
    as_policy,
    as_seed,
    as_threads,
)
from flockesc_env.common.errors import ArgumentError
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.episodes.predators import PredatorPolicy, PredatorPolicySpec, with_learned
from flockesc_env.episodes.seeds import fresh_seed
from flockesc_env.episodes.spaces import STACKED, Label, ObservationLayout, PolicySpec, RangeActions
from flockesc_env.scenario.flock import FlockScenario

Observations = NDArray[np.float32]

Columns = dict[str, NDArray[Any]]
"""``info`` of several flocks without ``interaction_range``: an array per key, with an entry per flock."""

Step = tuple[Observations, FloatArray, NDArray[np.bool], FloatArray, Columns]
"""Observations (num_flocks * rows, entries), rewards (num_flocks * rows,), whether each flock's episode has
ended (num_flocks,), ranges in m (num_flocks * rows,), and columns of ``info``."""

AtEnd = Literal["refuse", "restart", "stay"]

STARTS: Final = ("initial_positions", "initial_velocities", "predator_positions", "predator_velocities")
RESET_OPTIONS: Final = (*STARTS, "episode")
"""Keys of the ``options`` of a reset: arrays, and a number of an episode."""

Start = Mapping[str, Any]
"""Those that were given, checked; the rest is the seed's or the scenario's, the episode the next one."""

MAX_FLOCKS: Final = 1_000_000
"""Flocks of a batch: many more would not fit into memory, and a process that runs out of it is killed."""

NO_START: Final[Start] = MappingProxyType({})


class FlockBatch:
    """Episodes of one scenario, stepped together; slots do not influence each other.

    Args:
        scenario: the flock model's parameters.
        options: what actions mean, what is paid, what is seen.
        num_flocks: number of slots.
        per_agent: whether every agent has its own range and observation row, or every flock one.
        num_threads: threads over which slots, or a single large flock, are spread; ``None``: one per core.
        predator_policy: steers the learned predators, to whom all predators belong where there is none yet;
            ``None``: whoever steps does, or nobody.

    Attributes:
        rows: observation rows and ranges per flock: 1, or the number of agents.
        spec: what a policy needs to know.
        predator_policy_spec: the same of a learned predator's policy.
    """

    def __init__(
        self,
        scenario: FlockScenario,
        options: EnvOptions,
        *,
        num_flocks: int = 1,
        per_agent: bool = False,
        num_threads: int | None = None,
        predator_policy: PredatorPolicy | None = None,
    ) -> None:
        if predator_policy is not None:
            as_policy(predator_policy, "predator_policy")
            scenario = with_learned(scenario)
        per_agent = as_flag(per_agent, "per_agent")
        self.scenario = scenario
        self.predator_policy_spec = PredatorPolicySpec.of(scenario)
        self._predator_policy = predator_policy
        self._begun: list[int] = []  # slots whose episode began since the predator policy's last action
        self.options = options
        self.num_flocks = as_count(num_flocks, "num_flocks", most=MAX_FLOCKS)
        self.rows = scenario.num_agents if per_agent else 1
        threads = as_threads(num_threads)
        self.policy_spec = PolicySpec(
            actions=RangeActions(options),
            layout=ObservationLayout.of(_core.observation_entries(per_agent, scenario.dimension)),
            per_agent=per_agent,
            num_agents=scenario.num_agents,
            num_steps=scenario.num_steps,
        )
        self._core = _core.FlockBatch(
            scenario.to_json(),
            options.to_core(per_agent=per_agent),
            self.policy_spec.actions.core,
            self.num_flocks,
            threads,
            options.count_components,
            fresh_seed(),
        )

    def start(self, options: Mapping[str, Any] | None) -> Start:
        """Check the ``options`` of a reset, before anything changes.

        Args:
            options: any of ``initial_positions`` and ``initial_velocities``, shape (n, D), and
                ``predator_positions`` and ``predator_velocities``, shape (P, D), in m and m/s; and
                ``episode``, which episode of the schedule this is (``episode_seed``).

        Raises:
            ArgumentError: naming what has an unknown name, a wrong shape or an entry that is not finite, or
                is no integer from 0 to 2^64 - 1.
        """
        dimension = self.scenario.dimension
        agents = (self.scenario.num_agents, dimension)
        predators = (len(self.scenario.predators), dimension)
        shapes = dict(zip(STARTS, (agents, agents, predators, predators), strict=True))
        start: dict[str, Any] = {}
        for name, value in as_options(options, RESET_OPTIONS).items():
            if value is not None:
                shape = shapes.get(name)
                start[name] = (
                    as_seed(value, f"options[{name!r}]") if shape is None else as_floats(value, name, shape)
                )
        return start

    def reset(
        self, slots: Sequence[int], seeds: Sequence[int | None] | None = None, start: Start = NO_START
    ) -> tuple[Observations, Columns]:
        """Start episodes in some slots, in the states that ``start`` gives and else in those of the seeds.

        Without an ``episode`` in ``start`` it is the first of a seed that is given, or else the next one.

        Args:
            slots: which.
            seeds: one per slot of ``slots``, which begins a schedule (``episode_seed``); ``None``: the slot's
                own goes on.
            start: what ``start`` returned.

        Returns:
            Observations (len(slots) * rows, entries) and columns of ``info``, of ``slots`` only.
        """
        began = self._core.reset(slots, seeds or [None] * len(slots), **start)
        self._begun += slots
        return began

    def step(
        self,
        actions: Any,
        *,
        label: Label = STACKED,
        at_end: AtEnd = "refuse",
        out: tuple[Observations, FloatArray] | None = None,
        controls: FloatArray | None = None,
    ) -> Step:
        """Hold the ranges that actions set for one action in every slot.

        Args:
            actions: shape (num_flocks * rows, 1) or, where discrete, (num_flocks * rows,).
            label: names an action in an error.
            at_end: what a slot does at its end: it refuses to step or ignores its action, is paid
                0 and starts the next episode of its schedule (``"restart"``) or stays as it is (``"stay"``).
            out: arrays for the observations and rewards; ``None``: new ones.
            controls: actions of the learned predators, shape (num_flocks * predators, D), from
                ``predator_policy_spec``; ``None``: those of the predator policy or, without one, 0.

        Raises:
            ActionError: for a wrong dtype or shape, or an action outside of the action space, save those of
                agents that were caught before.
            EpisodeError: if a slot was never reset or its episode has ended and that is refused.
            KeyboardInterrupt: on Ctrl-C in a step of many agents. It leaves all flocks as they are after the
                step, if that ends at once, or else as they were before it, if it holds for 100 steps of the
                model or more; otherwise without an episode, so that the next step asks for a reset.
        """
        controls = self._controls() if controls is None else controls
        step = self._core.step(actions, at_end, out, controls)
        if step is None:
            ignored = self._core.ignored(at_end)
            count = self.num_flocks * self.rows
            plain = self.policy_spec.actions.plain(actions, count, label, ignored)
            step = self._core.step(plain, at_end, out, controls)
            assert step is not None  # noqa: S101, what `plain` returns is what the core takes
        if at_end == "restart":
            self._begun += np.flatnonzero(step[2]).tolist()
        return step

    def step_one(self, action: Any) -> tuple[Observations, float, bool, dict[str, Any]]:
        """Do as ``step`` for the only action of a batch of one row.

        Returns:
            Observation (entries,), reward, whether the episode has ended, and ``info``.

        Raises:
            ActionError: naming ``action``, as ``step``.
            EpisodeError: as ``step``.
        """
        controls = self._controls()
        step = self._core.step_one(action, controls)
        if step is None:
            step = self._core.step_one(self.policy_spec.actions.plain_one(action), controls)
            assert step is not None  # noqa: S101, as in `step`
        return step

    def observe(self, slots: Sequence[int]) -> Observations:
        """Return the observations of some slots, shape (len(slots) * rows, entries)."""
        return self._core.observe(slots)

    def observe_predators(self, slots: Sequence[int]) -> Observations:
        """Return what learned predators see in some slots, shape (len(slots) * predators, entries)."""
        return self._core.observe_predators(slots)

    def metrics(self) -> Columns:
        """Return the columns of ``info`` of all slots, without ``num_components``."""
        return self._core.metrics()

    def num_components(self) -> NDArray[np.int64]:
        """Return the connected components under the ranges of the last action, shape (num_flocks,)."""
        return self._core.num_components()

    def has_ended(self, slot: int) -> bool:
        """Return whether the episode in one slot has ended."""
        return self._core.has_ended(slot)

    def caught(self) -> NDArray[np.bool]:
        """Return which agents were caught, shape (num_flocks, n)."""
        return self._core.caught()

    def drawn(self, slot: int) -> FlockScenario:
        """Return the scenario of the episode in one slot, which draws nothing any more."""
        if not self.scenario.randomization:
            return self.scenario
        return self.scenario.drawn(self._core.episode_seed(slot))

    def state(self, slot: int) -> dict[str, Any]:
        """Return a copy of everything that moves in one slot, with ``step`` and ``interaction_range``."""
        return self._core.state(slot)

    def get_state(self, slots: Any = None) -> bytes:
        """Return everything that the future of some slots depends on, as bytes.

        Args:
            slots: index of one, or indices of several; ``None``: all.

        Raises:
            ArgumentError: for an index out of bounds.
            EpisodeError: for a slot that was never reset.
        """
        return self._core.get_state(self._slots(slots))

    def set_state(self, state: Any, slots: Any = None) -> list[int]:
        """Make some slots what ``get_state`` returned, of as many or of one; return which.

        Raises:
            ArgumentError: for an index out of bounds, or bytes that are damaged, of another version, scenario
                or interface, other options or another number of slots. Nothing has changed then.
            EpisodeError: if another slot was never reset.
        """
        chosen = self._slots(slots)
        for other in set(range(self.num_flocks)).difference(chosen):
            self._core.has_ended(other)  # refuses those that were never reset
        self._core.set_state(chosen, as_bytes(state, "state"))
        self._begun += chosen  # a predator policy's memory is not part of a state
        return chosen

    def _slots(self, slots: Any) -> list[int]:
        if slots is None:
            return list(range(self.num_flocks))
        is_one = not isinstance(slots, Iterable) or (isinstance(slots, np.ndarray) and slots.ndim == 0)
        given = [slots] if is_one else list(slots)
        if not given:
            raise ArgumentError("flocks", "an index or indices", "none")
        chosen = [as_seed(slot, f"flocks[{place}]") for place, slot in enumerate(given)]
        for place, slot in enumerate(chosen):
            if slot >= self.num_flocks:
                raise ArgumentError(f"flocks[{place}]", f"an integer below {self.num_flocks}", slot)
        return chosen

    def _controls(self) -> FloatArray | None:
        if self._predator_policy is None:
            return None
        observations = self._core.observe_predators(range(self.num_flocks))
        if self._begun:
            begins = np.isin(np.arange(self.num_flocks), self._begun)
            reset_policy(self._predator_policy, np.repeat(begins, self.predator_policy_spec.count))
            self._begun = []
        actions = self._predator_policy.act(observations, self.predator_policy_spec)
        return self.predator_policy_spec.plain(actions, len(observations), "actions of the predator policy")


def is_over(columns: Mapping[str, Any]) -> Any:
    """Return whether nobody is left in each flock: its episode terminates, others are truncated."""
    return columns["fraction_surviving"] == 0.0


def infos(columns: Columns) -> list[dict[str, Any]]:
    """Return one new ``info`` of plain numbers per flock, without ``interaction_range``."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]
