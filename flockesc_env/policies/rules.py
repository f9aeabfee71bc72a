"""Rules that decide agent by agent from what the agent sees."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_floats
from flockesc_env.common.errors import ArgumentError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations, RowMemory


class StubbornLeaders:
    """The rule of thumb: agents that already head away from the predator stop listening; others listen.

    rho_i = 0 if the cosine of the angle between the agent's heading and the direction away from the predator
    exceeds ``min_cosine``, else ``interaction_range``. An agent that senses no predator listens. Needs one
    observation per agent.

    Args:
        min_cosine: cosine above which an agent stops listening.
        interaction_range: rho in m of those who listen.
    """

    per_agent: ClassVar[bool] = True

    def __init__(self, min_cosine: float = 0.8, interaction_range: float = 10.0) -> None:
        self.min_cosine = float(as_floats(min_cosine, "min_cosine", ()))
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Choose who listens.

        Raises:
            ArgumentError: if rows are flocks instead of agents.
        """
        _check_rows_are_agents(spec)
        # Directions are in the agent's own frame, whose first axis is its heading.
        cosine_away = -observations[:, spec.layout.index("predator_direction_ahead")]
        ranges: FloatArray = np.where(cosine_away > self.min_cosine, 0.0, self.interaction_range)
        return spec.actions.from_ranges(ranges)


class StubbornWitnesses(RowMemory):
    """The rule for a predator seen only nearby: wait, hear of it, and stop listening once it was seen.

    Until ``patience`` has passed, and for the rest of the episode once agent i has sensed the predator,
    rho_i = 0. Otherwise rho_i = ``first_range`` at its first action after the wait, and ``interaction_range``
    from then on. Needs one observation per agent, and all agents at every action: it remembers who has seen
    the predator in this episode. Made for one step per action.

    Args:
        patience: share of the episode during which no agent listens: before the predator comes, agents would
            only agree on some direction.
        first_range: rho in m of the first action after that, by which news travels far at once.
        interaction_range: rho in m of those who go on listening.
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
        """Choose who listens.

        Raises:
            ArgumentError: if rows are flocks instead of agents, or appear or vanish within an episode.
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


def _check_rows_are_agents(spec: PolicySpec) -> None:
    if not spec.per_agent:
        raise ArgumentError("per_agent", "True: this policy needs an observation per agent", spec.per_agent)
