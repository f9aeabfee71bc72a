"""A hand-written rule without a memory that compares the entries of an observation."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_floats
from flockesc_env.common.errors import ArgumentError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations


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
        check_rows_are_agents(spec)
        # Directions are in the agent's frame, whose first axis is its heading.
        cosine_away = -observations[:, spec.layout.index("predator_direction_ahead")]
        ranges: FloatArray = np.where(cosine_away > self.min_cosine, 0.0, self.interaction_range)
        return spec.actions.from_ranges(ranges)


def check_rows_are_agents(spec: PolicySpec) -> None:
    """Raise an ``ArgumentError`` if there is one row per flock."""
    if not spec.per_agent:
        expected = "True, because the policy needs one observation per agent"
        raise ArgumentError("per_agent", expected, spec.per_agent)
