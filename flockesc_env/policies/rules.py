"""Hand-written rules without a memory that compare the entries of an observation."""

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


class ListenWhileFleeing:
    """A rule for one range for the flock: all agents listen while the flock heads away from the predator.

    rho = ``interaction_range`` if the mean over agents of the cosine between heading and the direction away
    from the predator exceeds ``min_cosine``, otherwise rho = 0. Alignment then strengthens a good mean
    heading and never a bad one. The rule requires one observation per flock.

    Args:
        min_cosine: mean cosine above which all agents listen.
        interaction_range: rho in m while they listen.

    Raises:
        ArgumentError: if an argument is not a finite number, or ``interaction_range`` is negative.
    """

    per_agent: ClassVar[bool] = False

    def __init__(self, min_cosine: float = 0.05, interaction_range: float = 20.0) -> None:
        self.min_cosine = float(as_floats(min_cosine, "min_cosine", ()))
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of every flock; see ``Policy.act``.

        Raises:
            ArgumentError: if ``spec.per_agent`` is True.
        """
        if spec.per_agent:
            expected = "False, because the policy needs one observation per flock"
            raise ArgumentError("per_agent", expected, spec.per_agent)
        is_fleeing = observations[:, spec.layout.index("heading_away")] > self.min_cosine
        return spec.actions.from_ranges(np.where(is_fleeing, self.interaction_range, 0.0))


def check_rows_are_agents(spec: PolicySpec) -> None:
    """Raise an ``ArgumentError`` if there is one row per flock."""
    if not spec.per_agent:
        expected = "True, because the policy needs one observation per agent"
        raise ArgumentError("per_agent", expected, spec.per_agent)
