"""Hand-written rules: which range an agent or the flock sets, from simple comparisons of its observation."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_flag, as_floats, as_text
from flockesc_env.common.errors import ArgumentError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations, RowMemory


class StubbornLeaders:
    """A rule of thumb: agents that fly away from the predator stop listening; all others listen.

    rho_i = 0 if the cosine of the angle between the heading of agent i and the direction away from the
    predator exceeds ``min_cosine``, otherwise rho_i = ``interaction_range``. An agent that observes no
    predator listens. The rule requires one observation per agent.

    Args:
        min_cosine: cosine above which an agent stops listening.
        interaction_range: rho in m of agents that listen.

    Raises:
        ArgumentError: if an argument is not a finite number, or ``interaction_range`` is negative.
    """

    per_agent: ClassVar[bool] = True

    def __init__(self, min_cosine: float = 0.8, interaction_range: float = 10.0) -> None:
        self.min_cosine = float(as_floats(min_cosine, "min_cosine", ()))
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of every agent; see ``Policy.act``.

        Raises:
            ArgumentError: if ``spec.per_agent`` is False.
        """
        _check_rows_are_agents(spec)
        # Directions are in the agent's frame, whose first axis is its heading.
        cosine_away = -observations[:, spec.layout.index("predator_direction_ahead")]
        ranges: FloatArray = np.where(cosine_away > self.min_cosine, 0.0, self.interaction_range)
        return spec.actions.from_ranges(ranges)


class StubbornWitnesses(RowMemory):
    """A rule for a predator that is visible only nearby: agents that have seen it stop listening.

    rho_i = 0 until the share ``patience`` of the episode has passed, and also from the moment at which agent
    i observes the predator until the end of the episode. Otherwise rho_i = ``first_range`` in the first
    action after the wait and ``interaction_range`` in all later ones. The rule requires one observation per
    agent and all agents in every call, because it remembers which agents have seen the predator. Its default
    parameters are for ``steps_per_action=1``.

    Args:
        patience: share of the episode during which no agent listens. Before the predator arrives, listening
            only aligns the flock in an arbitrary direction.
        first_range: rho in m of the first action after the wait. A long range spreads the news fast.
        interaction_range: rho in m of later actions.

    Raises:
        ArgumentError: if an argument is not a finite number >= 0.
    """

    per_agent: ClassVar[bool] = True

    def __init__(
        self, patience: float = 0.125, first_range: float = 60.0, interaction_range: float = 17.0
    ) -> None:
        given = {"patience": patience, "first_range": first_range, "interaction_range": interaction_range}
        numbers = [as_floats(value, name, (), least=0.0) for name, value in given.items()]
        self.parameters: FloatArray = np.array(numbers)
        self._has_seen = self._has_heard = np.zeros(0, bool)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of every agent; see ``Policy.act``.

        Raises:
            ArgumentError: if ``spec.per_agent`` is False, or the number of rows changes during an episode.
        """
        _check_rows_are_agents(spec)
        begins = self._take_begins(len(observations))
        if begins.all():
            self._has_seen = self._has_heard = np.zeros(len(observations), bool)
        patience, first, later = self.parameters
        time = observations[:, spec.layout.index("time")]
        is_seen = observations[:, spec.layout.index("predator_sensed")] > 0
        self._has_seen = (self._has_seen & ~begins) | is_seen
        heard = self._has_heard & ~begins
        waits = time < patience
        ranges = np.where(waits | self._has_seen, 0.0, np.where(heard, later, first))
        self._has_heard = heard | ~waits
        return spec.actions.from_ranges(ranges)


class ListenWhileThreatened(RowMemory):
    """A rule for the nearest agent and a predator that is visible only nearby.

    An agent that has not yet observed the predator listens to all: rho_i = ``unaware_range``. One that has
    observed it listens, rho_i = ``aware_range``, as long as its closest approach is below ``safe_distance``
    and the heading of the heard velocity would keep it farther away. Otherwise rho_i = 0. The rule requires
    one observation per agent, with ``extra_entries=("closest_approach",)``.

    Args:
        unaware_range: rho in m before the agent has observed the predator.
        aware_range: rho in m of agents that listen later.
        safe_distance: closest approach in m at which an agent stops listening.

    Raises:
        ArgumentError: if an argument is not a finite number >= 0.
    """

    per_agent: ClassVar[bool] = True

    def __init__(
        self, unaware_range: float = 150.0, aware_range: float = 20.0, safe_distance: float = 25.0
    ) -> None:
        self.unaware_range = float(as_floats(unaware_range, "unaware_range", (), least=0.0))
        self.aware_range = float(as_floats(aware_range, "aware_range", (), least=0.0))
        self.safe_distance = float(as_floats(safe_distance, "safe_distance", (), least=0.0))
        self._has_seen = np.zeros(0, bool)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of every agent; see ``Policy.act``.

        Raises:
            ArgumentError: if ``spec.per_agent`` is False, the observation has no closest approach, or the
                number of rows changes during an episode.
        """
        _check_rows_are_agents(spec)
        begins = self._take_begins(len(observations))
        if begins.all():
            self._has_seen = np.zeros(len(observations), bool)
        own = observations[:, spec.layout.index("closest_approach")]
        heard = observations[:, spec.layout.index("heard_closest_approach")]
        is_seen = observations[:, spec.layout.index("predator_sensed")] > 0
        self._has_seen = (self._has_seen & ~begins) | is_seen
        is_threatened = own < self.safe_distance / (self.safe_distance + spec.length_scale)
        aware = np.where(is_threatened & (heard > own), self.aware_range, 0.0)
        return spec.actions.from_ranges(np.where(self._has_seen, aware, self.unaware_range))


class BestCandidate:
    """A rule for observations with a profile: the candidate range under which one entry is largest.

    Of equal candidates it sets the shortest. With ``"escape_cosine"`` an agent listens at the range at which
    the heard velocity points nearest to its escape direction; with ``"closest_approach"`` at the one whose
    heard heading keeps the predator farthest away. With one range for the flock, ``"heading_escape"`` turns
    the flock toward the escape directions.

    Args:
        entry: name of an entry of the candidates, without ``profile_k_``.
        per_agent: True: one range per agent. False: one per flock.
        unaware_range: rho in m of rows that observe no predator.

    Raises:
        ArgumentError: if an argument has the wrong type, or ``unaware_range`` is negative.
    """

    def __init__(self, entry: str, *, per_agent: bool = True, unaware_range: float = 0.0) -> None:
        self.entry = as_text(entry, "entry")
        self.unaware_range = float(as_floats(unaware_range, "unaware_range", (), least=0.0))
        self.per_agent = as_flag(per_agent, "per_agent")

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of every row; see ``Policy.act``.

        Raises:
            ArgumentError: if the observation has no profile, or no such entry.
        """
        ranges = np.array(spec.profile_ranges)
        if not ranges.size:
            raise ArgumentError("profile_ranges", "candidate ranges", "none")
        columns = [spec.layout.index(f"profile_{k}_{self.entry}") for k in range(ranges.size)]
        chosen = ranges[observations[:, columns].argmax(axis=1)]
        is_aware = observations[:, spec.layout.index("predator_sensed")] > 0
        return spec.actions.from_ranges(np.where(is_aware, chosen, self.unaware_range))


def _check_rows_are_agents(spec: PolicySpec) -> None:
    if not spec.per_agent:
        expected = "True, because the policy needs one observation per agent"
        raise ArgumentError("per_agent", expected, spec.per_agent)
