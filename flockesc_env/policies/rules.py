"""``RangeRule`` (base of hand-written rules) and rules that compare the entries of an observation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_floats
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations, StoredPolicy


class RangeRule(StoredPolicy, ABC):
    """Base of rules that return a range for every observation row.

    Attributes:
        per_agent: True: the rule requires one observation per agent. False: one per flock.
    """

    per_agent: bool = True

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of every row; see ``Policy.act``.

        Raises:
            ArgumentError: if ``spec.per_agent`` is not the rule's, an option differs from those of the rule's
                file, the observation lacks an entry or a profile that the rule reads, or a rule has a memory
                and the number of rows changes during an episode.
        """
        self.check(spec.options, per_agent=spec.per_agent)
        return spec.actions.from_ranges(self._ranges(observations, spec))

    @abstractmethod
    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        """Return the range in m of every row."""


class StubbornLeaders(RangeRule):
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

    def __init__(self, min_cosine: float = 0.8, interaction_range: float = 10.0) -> None:
        self.min_cosine = float(as_floats(min_cosine, "min_cosine", ()))
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        # Directions are in the agent's frame, whose first axis is its heading.
        cosine_away = -observations[:, spec.layout.index("predator_direction_ahead")]
        return np.where(cosine_away > self.min_cosine, 0.0, self.interaction_range)


class ListenWhileFleeing(RangeRule):
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

    per_agent = False

    def __init__(self, min_cosine: float = 0.05, interaction_range: float = 20.0) -> None:
        self.min_cosine = float(as_floats(min_cosine, "min_cosine", ()))
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        is_fleeing = observations[:, spec.layout.index("heading_away")] > self.min_cosine
        return np.where(is_fleeing, self.interaction_range, 0.0)


def not_negative(**given: float) -> FloatArray:
    """Return the parameters of a rule after validation: finite numbers >= 0."""
    return np.array([as_floats(value, name, (), least=0.0) for name, value in given.items()])
