"""Hand-written rules without a memory: simple comparisons of the entries of an observation."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_flag, as_floats, as_text
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


class BestCandidate:
    """A rule for observations with a profile: the candidate range under which one entry is largest.

    Of equal candidates it sets the shortest. With ``"escape_cosine"`` an agent listens at the range at which
    the heard velocity points nearest to its escape direction; with ``"closest_approach"`` at the one whose
    heard heading keeps the predator farthest away. With one range for the flock, ``"heading_escape"`` turns
    the flock toward the escape directions.

    With a ``polarization_cost`` the flock does not agree on a heading before a good one turns up: a candidate
    scores its entry minus the cost times its polarization.

    Args:
        entry: name of an entry of the candidates, without ``profile_k_``.
        per_agent: True: one range per agent. False: one per flock.
        unaware_range: rho in m of rows that observe no predator.
        polarization_cost: factor of the candidates' polarization; not 0 only with one range per flock.

    Raises:
        ArgumentError: if an argument has the wrong type, or ``unaware_range`` or ``polarization_cost`` is
            negative.
    """

    def __init__(
        self,
        entry: str,
        *,
        per_agent: bool = True,
        unaware_range: float = 0.0,
        polarization_cost: float = 0.0,
    ) -> None:
        self.entry = as_text(entry, "entry")
        self.unaware_range = float(as_floats(unaware_range, "unaware_range", (), least=0.0))
        self.polarization_cost = float(as_floats(polarization_cost, "polarization_cost", (), least=0.0))
        self.per_agent = as_flag(per_agent, "per_agent")

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of every row; see ``Policy.act``.

        Raises:
            ArgumentError: if the observation has no profile, or no such entry.
        """
        ranges = np.array(spec.profile_ranges)
        if not ranges.size:
            raise ArgumentError("profile_ranges", "candidate ranges", "none")
        scores = observations[:, _columns(self.entry, spec)]
        if self.polarization_cost:
            scores = scores - self.polarization_cost * observations[:, _columns("polarization", spec)]
        chosen = ranges[scores.argmax(axis=1)]
        is_aware = observations[:, spec.layout.index("predator_sensed")] > 0
        return spec.actions.from_ranges(np.where(is_aware, chosen, self.unaware_range))


def _columns(entry: str, spec: PolicySpec) -> list[int]:
    """Return the columns of an entry of all candidates."""
    return [spec.layout.index(f"profile_{k}_{entry}") for k in range(len(spec.profile_ranges))]


def check_rows_are_agents(spec: PolicySpec) -> None:
    """Raise an ``ArgumentError`` if there is one row per flock."""
    if not spec.per_agent:
        expected = "True, because the policy needs one observation per agent"
        raise ArgumentError("per_agent", expected, spec.per_agent)
