"""Hand-written rules with a memory: what an agent has seen or heard before decides which range it sets."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_choice
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import Observations, RowMemory
from flockesc_env.policies.rules import RangeRule, dot, unit, unscaled, vector_entries

Criterion = Literal[
    "closest_approach", "escape_direction", "estimated_escape_direction", "estimated_encounter"
]


@dataclass(eq=False, repr=False)
class StubbornWitnesses(RangeRule, RowMemory):
    """A rule for a predator that is visible only nearby: agents that have seen it stop listening.

    rho_i = 0 until the share ``patience`` of the episode has passed, and also from the moment at which agent
    i observes the predator until the end of the episode. Otherwise rho_i = ``first_range`` in the first
    action after the wait. In all later ones, at the share t of the episode, rho_i is

        interaction_range + growth (t - patience) + crowding ln(1 + N) - agreement c,

    at least 0 and at most the largest range. N is the number of others that the agent heard in the last
    action, c the cosine between its heading and the velocity that it heard. The rule requires one observation
    per agent and all agents in every call, because it remembers which agents have seen the predator. The
    defaults are for ``steps_per_action=1``. Those of the first three arguments come from a search on training
    flocks; the other terms are off.

    Args:
        patience: share of the episode during which no agent listens. Meanwhile the agents that head out of
            the flock get to its edge, so that neighbors come to head outward on average.
        first_range: rho in m of the first action after the wait.
        interaction_range: rho in m of later actions, without the other terms.
        growth: growth of rho in m per episode.
        min_neighbors: an agent that hears fewer others in a later action stops listening for good.
        crowding: growth of rho in m if N + 1 grows by a factor of e: inner agents listen farther.
        agreement: decrease of rho in m with c: agents that agree with what they hear listen less far.
    """

    patience: float = 0.125
    first_range: float = 60.0
    interaction_range: float = 17.0
    growth: float = 0.0
    min_neighbors: float = 0.0
    crowding: float = 0.0
    agreement: float = 0.0

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        begins = self._begin(len(observations))
        has_stopped, heard, is_later = self._recall(begins, False, False, False)
        patience, first, later, growth, min_neighbors, crowding, agreement = self.parameters
        time = observations[:, spec.layout.index("time")].astype(np.float64)
        is_seen = observations[:, spec.layout.index("predator_sensed")] > 0
        scaled = observations[:, spec.layout.index("neighbor_count")].astype(np.float64)
        count = np.rint(8 * scaled / (1 - scaled))  # the entry is count / (count + 8)
        cosine = unit(vector_entries("heard_velocity_", observations, spec))[:, 0]
        has_stopped |= is_seen | (is_later & (count < min_neighbors))
        waits = time < patience
        later = later + growth * (time - patience)
        later += crowding * _core.log1p(count) - agreement * cosine
        ranges = np.where(waits | has_stopped, 0.0, np.where(heard, np.maximum(later, 0.0), first))
        self._remember(len(begins), has_stopped, heard | ~waits, heard)
        return ranges


@dataclass(eq=False, repr=False)
class ListenWhileThreatened(RangeRule, RowMemory):
    """A rule for the nearest agent and a predator that is visible only nearby.

    An agent that has not yet observed the predator listens to all: rho_i = ``unaware_range``. One that has
    observed it listens, rho_i = ``aware_range``, as long as its closest approach is below ``safe_distance``
    and the heading of the heard velocity would keep it farther away. Otherwise rho_i = 0. The rule requires
    one observation per agent, with ``extra_entries=("closest_approach",)``. The defaults were chosen by hand.

    Args:
        unaware_range: rho in m before the agent has observed the predator.
        aware_range: rho in m of agents that listen later.
        safe_distance: closest approach in m at which an agent stops listening.
    """

    unaware_range: float = 150.0
    aware_range: float = 20.0
    safe_distance: float = 25.0

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        begins = self._begin(len(observations))
        (has_seen,) = self._recall(begins, False)
        own = observations[:, spec.layout.index("closest_approach")]
        heard = observations[:, spec.layout.index("heard_closest_approach")]
        has_seen |= observations[:, spec.layout.index("predator_sensed")] > 0
        unaware_range, aware_range, safe_distance = self.parameters
        is_threatened = own < safe_distance / (safe_distance + spec.scenario.length_scale)
        aware = np.where(is_threatened & (heard > own), aware_range, 0.0)
        self._remember(len(begins), has_seen)
        return np.where(has_seen, aware, unaware_range)


@dataclass(eq=False, repr=False)
class WinStayLoseShift(RangeRule, RowMemory):
    """A rule with two ranges: stay with the one that helps, otherwise try the other one.

    An agent compares its own heading with the heading that it heard in the last action. With the criterion
    ``"closest_approach"`` the better heading is the one that keeps the predator farther away, a rule for the
    nearest agent. With ``"escape_direction"`` it is the one nearer to the escape direction, a rule for the
    mean distance. With ``"estimated_escape_direction"`` it is the one nearer to the agent's own estimate of
    that direction: the unit vector along

        -(d + max(0, ``encounter_time`` - t) v_p),

    where d in m is the vector from the agent to its nearest predator, v_p in m/s that predator's velocity,
    and t in s the time. It points away from the predator's place at ``encounter_time``, and later from its
    present place. The estimate is 0 if the agent observes no predator. ``"estimated_encounter"`` needs no
    clock: the remaining time is max(0, -d . v_p / (||v_p||^2 + v0^2 / 2)), which minimizes the sum of the
    squared distance to the predator and (v0 t)^2 / 2.

    An agent wins if it listened and heard a better heading than its own. It then stays
    with its range. If it listened and does not win, it shifts from ``short_range`` to ``long_range`` or back,
    and has rho_i = 0 during the next ``pause`` seconds, rounded to whole actions. After that it listens as
    long as the value of its own heading is below ``threshold``. All other agents have rho_i = 0.

    The rule requires one observation per agent and a predator that is visible at any distance, and all agents
    in every call. Each of the first two criteria requires the entry of ``extra_entries`` with its name. The
    defaults were chosen by hand for the first criterion. For the others, the built-in rules have 10 m, 50 m,
    a cosine of 0.85 and 0.1 s, chosen by hand for an action in every step.

    Args:
        short_range: one rho in m.
        long_range: the other rho in m.
        threshold: closest approach in m, or cosine between heading and (estimated) escape direction, below
            which an agent listens.
        pause: time in s for which an agent that did not win does not listen.
        encounter_time: supposed time in s of the predator's closest approach to the flock, only for
            ``"estimated_escape_direction"``. The default fits the paper's flock.
        criterion: ``"closest_approach"``, ``"escape_direction"``, ``"estimated_escape_direction"`` or
            ``"estimated_encounter"``.
    """

    short_range: float = 10.0
    long_range: float = 50.0
    threshold: float = 32.0
    pause: float = 0.0
    encounter_time: float = 5.0
    criterion: Criterion = field(default="closest_approach", kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.criterion = as_choice(self.criterion, "criterion", get_args(Criterion))

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        begins = self._begin(len(observations))
        listened, is_long, paused = self._recall(begins, False, False, 1.0)
        short_range, long_range, threshold, pause, _ = self.parameters
        pause = np.rint(pause / (spec.options.steps_per_action * spec.scenario.time_step))  # in actions
        if self.criterion == "closest_approach":
            own: Any = observations[:, spec.layout.index("closest_approach")]
            is_better = observations[:, spec.layout.index("heard_closest_approach")] > own
            threshold = threshold / (threshold + spec.scenario.length_scale)
        elif self.criterion == "escape_direction":
            own = observations[:, spec.layout.index("escape_direction_ahead")]
            is_better = observations[:, spec.layout.index("heard_escape_gain")] > 0
        else:
            escape = self._estimate(observations, spec)
            own = escape[:, 0]
            heard = dot(escape, unit(vector_entries("heard_velocity_", observations, spec)))
            is_better = heard > own + 1e-6  # an agent that hears only itself never wins by rounding
        wins = listened & is_better
        loses = listened & ~wins
        is_long ^= loses
        paused = np.where(loses, pause, paused - 1)
        listens = wins | ((own < threshold) & (paused <= 0))
        self._remember(len(begins), listens, is_long, paused)
        ranges = np.where(is_long, long_range, short_range)
        return np.where(listens, ranges, 0.0)

    def _estimate(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        """Return the estimated escape direction in the frame of every agent, shape (rows, axes)."""
        scenario = spec.scenario
        time = vector_entries("time", observations, spec) * spec.num_steps * scenario.time_step
        distance = unscaled(vector_entries("predator_distance", observations, spec)) * scenario.length_scale
        offset = distance * vector_entries("predator_direction_", observations, spec)
        velocity = unscaled(vector_entries("predator_velocity_", observations, spec))  # relative to the agent
        is_sensed = vector_entries("predator_sensed", observations, spec)
        velocity[:, :1] += is_sensed * unscaled(vector_entries("speed", observations, spec))
        velocity *= scenario.speed_scale
        if self.criterion == "estimated_encounter":
            square = scenario.speed_scale * scenario.speed_scale
            squares = dot(velocity, velocity)[:, np.newaxis] + square / 2
            remaining = np.maximum(-dot(offset, velocity)[:, np.newaxis] / squares, 0.0)
        else:
            remaining = np.maximum(self.parameters[-1] - time, 0.0)
        return -unit(offset + remaining * velocity)
