"""Hand-written rules for observations with a profile: they set the candidate range with the best score."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_flag, as_floats, as_text
from flockesc_env.common.errors import ArgumentError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations
from flockesc_env.policies.rules import RangeRule, not_negative


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
        polarization_cost: factor of the candidates' polarization. Only a profile of the flock shows it; for
            agents the cost must be 0.

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
        scores = candidate_entries(self.entry, observations, spec)
        if self.polarization_cost:
            scores -= self.polarization_cost * candidate_entries("polarization", observations, spec)
        return spec.actions.from_ranges(_best(scores, observations, spec, self.unaware_range))


class BestNextHeading(RangeRule):
    """A rule for the mean distance: the candidate range after which an agent heads best.

    One step turns agent i toward the direction h that it hears: its new heading is that of u + ``turn`` h,
    where u is its heading. The agent takes the candidate range whose new heading is nearest to its escape
    direction. ``BestCandidate("escape_cosine")`` compares the directions h themselves. Agents that observe no
    predator have rho_i = 0. The rule requires one observation per agent with a profile and
    ``extra_entries=("escape_direction",)``.

    Args:
        turn: weight of the heard direction: the alignment strength times the time step over the mass, 0.5 in
            the paper.

    Raises:
        ArgumentError: if ``turn`` is not a finite number >= 0.
    """

    def __init__(self, turn: float = 0.5) -> None:
        self.turn = float(as_floats(turn, "turn", (), least=0.0))

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        own = observations[:, [spec.layout.index("escape_direction_ahead")]].astype(np.float64)
        heard = candidate_entries("escape_cosine", observations, spec)
        ahead = unit(heard_velocities(observations, spec))[:, :, 0]
        lengths = np.sqrt(np.maximum(1 + 2 * self.turn * ahead + self.turn * self.turn, 1e-9))
        return _best((own + self.turn * heard) / lengths, observations, spec)


class StepAside(RangeRule):
    """A rule for the nearest agent: first turn away from the predator's path, then keep the distance.

    Each candidate range has a score: the closest approach under the heard heading, as observed, plus
    ``weight`` times the cosine between that heading and the agent's best heading. The weight decreases
    linearly to 0 until the share ``aside_time`` of the episode. The best heading is the one with the largest
    closest approach among all headings: it leads away from the predator's path at an angle to the predator's
    velocity V whose cosine is v0 / ‖V‖, or along V if the predator is not faster than v0. The agent takes the
    candidate with the largest score. With ``weight=0`` the rule is ``BestCandidate("closest_approach")``.
    Agents that observe no predator have rho_i = 0. The rule requires one observation per agent with a profile
    and ``extra_entries=("closest_approach",)``. Its default parameters are for the paper's flock and
    ``steps_per_action=1``.

    Args:
        aside_time: share of the episode after which only the closest approach counts.
        weight: weight of the best heading at the start.

    Raises:
        ArgumentError: if an argument is not a finite number >= 0.
    """

    def __init__(self, aside_time: float = 0.1, weight: float = 0.2) -> None:
        self.parameters = not_negative(aside_time=aside_time, weight=weight)

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        aside_time, weight = self.parameters
        scores = candidate_entries("closest_approach", observations, spec)
        time = observations[:, [spec.layout.index("time")]].astype(np.float64)
        weights = weight * np.maximum(1 - time / max(aside_time, 1e-9), 0)
        if weights.any():
            headings = unit(heard_velocities(observations, spec))
            scores += weights * dot(headings, _aside(observations, spec)[:, np.newaxis])
        return _best(scores, observations, spec)


def candidate_entries(entry: str, observations: Observations, spec: PolicySpec) -> FloatArray:
    """Return an entry of every candidate range, shape (rows, candidates).

    Raises:
        ArgumentError: if the observation has no profile, or no such entry.
    """
    if not spec.profile_ranges:
        raise ArgumentError("profile_ranges", "candidate ranges", "none")
    columns = [spec.layout.index(f"profile_{k}_{entry}") for k in range(len(spec.profile_ranges))]
    values: FloatArray = observations[:, columns].astype(np.float64)
    return values


def heard_velocities(observations: Observations, spec: PolicySpec) -> FloatArray:
    """Return the velocities heard within candidates in units of the largest v0, (rows, candidates, axes)."""
    prefixes = [f"profile_{k}_velocity_" for k in range(len(spec.profile_ranges))]
    return np.stack([_velocity(prefix, observations, spec) for prefix in prefixes], axis=1)


def vector_entries(prefix: str, observations: Observations, spec: PolicySpec) -> FloatArray:
    """Return the entries whose names begin with ``prefix``, shape (rows, axes)."""
    columns = [column for column, name in enumerate(spec.layout.names) if name.startswith(prefix)]
    vector: FloatArray = observations[:, columns].astype(np.float64)
    return vector


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the scalar products of vectors, whose axes are the last axis.

    The order of the additions does not depend on the machine, as it does in BLAS and in ``numpy.einsum``.
    """
    product: FloatArray = a[..., 0] * b[..., 0]
    for axis in range(1, a.shape[-1]):
        product += a[..., axis] * b[..., axis]
    return product


def unit(vectors: FloatArray) -> FloatArray:
    """Return the directions of some vectors; 0 stays 0."""
    return vectors / np.maximum(_norm(vectors), 1e-9)


def _norm(vectors: FloatArray) -> FloatArray:
    """Return the lengths of some vectors, with a last axis of length 1."""
    return np.sqrt(dot(vectors, vectors))[..., np.newaxis]


def _best(
    scores: FloatArray, observations: Observations, spec: PolicySpec, unaware_range: float = 0.0
) -> FloatArray:
    """Return the candidates with the best scores; ``unaware_range`` without a predator."""
    chosen = np.array(spec.profile_ranges)[scores.argmax(axis=1)]
    is_aware = observations[:, spec.layout.index("predator_sensed")] > 0
    return np.where(is_aware, chosen, unaware_range)


def _aside(observations: Observations, spec: PolicySpec) -> FloatArray:
    """Return the heading of every agent whose closest approach is largest, shape (rows, axes)."""
    direction = vector_entries("predator_direction_", observations, spec)
    velocity = _velocity("predator_velocity_", observations, spec)
    velocity[:, 0] += 1  # in units of v0, which is the agent's speed
    speed = np.maximum(_norm(velocity), 1e-9)
    along = velocity / speed
    across = unit(dot(direction, along)[:, np.newaxis] * along - direction)
    cosine = np.minimum(1 / speed, 1)
    aside: FloatArray = cosine * along + np.sqrt(1 - cosine * cosine) * across
    return aside


def _velocity(prefix: str, observations: Observations, spec: PolicySpec) -> FloatArray:
    """Return a velocity that entries show scaled, in units of the largest v0, shape (rows, axes)."""
    scaled = vector_entries(prefix, observations, spec)
    velocity: FloatArray = scaled / (1 - _norm(scaled))
    return velocity
