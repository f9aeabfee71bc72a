"""Policies without a memory: fixed, random and scheduled ranges, hand-written rules, rules for predators."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray, as_choice, as_floats, as_seed, as_text
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.predators import PredatorPolicySpec
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies.base import BasePolicy, Observations
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import Scenario

_LONGEST = 100.0
"""Option ``max_range`` of policies that are made by hand, in m."""


class FixedRange(BasePolicy):
    """A policy with a fixed range, as in the paper's grid search.

    Args:
        interaction_range: rho in m, at least 0.
    """

    def __init__(self, interaction_range: float) -> None:
        self.interaction_range = float(as_floats(interaction_range, "interaction_range", (), least=0.0))
        self.parameters: FloatArray = np.array([self.interaction_range])

    def default_options(self, scenario: Scenario) -> dict[str, Any]:
        """Return a ``max_range`` that includes the range."""
        return _including(self.interaction_range, scenario)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of the fixed range for every row; see ``Policy.act``."""
        return spec.actions.from_ranges(np.full(len(observations), self.interaction_range))


class RandomRange(BasePolicy):
    """A policy that draws a range for every row and action, uniform in [``min_range``, ``max_range``].

    Args:
        seed: seed of the random numbers; ``None``: a random seed from the operating system.
    """

    def __init__(self, seed: int | None = None) -> None:
        self._rng = np.random.default_rng(None if seed is None else as_seed(seed))

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return a random action for every row; see ``Policy.act``."""
        actions = spec.actions
        return actions.from_ranges(self._rng.uniform(actions.min_range, actions.max_range, len(observations)))


class ScheduledRange(BasePolicy):
    """An open-loop policy: ranges are a given function of time.

    Args:
        schedule: rho in m in every step of the episode, shape (T,), or for every agent, shape (T, n). If an
            action lasts several steps, the entry of the first step is used.
    """

    def __init__(self, schedule: ArrayLike) -> None:
        self.schedule = as_floats(schedule, "schedule", least=0.0)
        if self.schedule.ndim not in {1, 2} or not self.schedule.size:
            raise InputError("schedule", "shape (T,) or (T, n)", f"shape {self.schedule.shape}")
        self.per_agent = True if self.schedule.ndim == 2 else None

    def check_length(self, num_steps: int) -> None:
        """Check that the schedule has a range for every step of an episode."""
        if len(self.schedule) != num_steps:
            raise InputError("schedule", f"{num_steps} steps", len(self.schedule))

    def default_options(self, scenario: Scenario) -> dict[str, Any]:
        """Return one step per action, and a ``max_range`` that includes all ranges."""
        return {"steps_per_action": 1, **_including(float(self.schedule.max()), scenario)}

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of the scheduled range for every row; see ``Policy.act``."""
        self.check_length(spec.num_steps)
        time = observations[:, spec.layout.index("time")].astype(np.float64)
        steps = np.minimum(np.rint(time * spec.num_steps).astype(int), spec.num_steps - 1)
        if self.schedule.ndim == 1:
            return spec.actions.from_ranges(self.schedule[steps])
        agents = self.schedule.shape[1]
        if not spec.per_agent or agents != spec.num_agents or len(observations) % agents:
            raise InputError("schedule", f"rows of all {agents} agents of each flock", len(observations))
        return spec.actions.from_ranges(self.schedule[steps, np.arange(len(steps)) % agents])


def _including(rho: float, scenario: Scenario) -> dict[str, Any]:
    return {"max_range": max(rho, 1.0 if isinstance(scenario, LineScenario) else _LONGEST)}


class RangeRule(BasePolicy):
    """Base of rules that return a range for every observation row; they are dataclasses.

    Their numbers are finite and, unless they are cosines, at least 0.

    Attributes:
        per_agent: True: the rule requires one observation per agent. False: one per flock.
        parameters: the fields that are numbers, in order.
    """

    per_agent: bool | None = True
    parameters: FloatArray

    def __post_init__(self) -> None:
        """Check that the numbers among the fields are finite and, unless they are cosines, at least 0."""
        names = [field.name for field in fields(self) if field.type == "float"]  # type: ignore[arg-type]
        least = {name: -np.inf if "cosine" in name else 0.0 for name in names}
        numbers = {name: float(as_floats(getattr(self, name), name, (), least=least[name])) for name in names}
        vars(self).update(numbers)
        self.parameters = np.array([*numbers.values()])

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of every row; see ``Policy.act``. Ranges are at most ``max_range``.

        Another view or other options than the rule's (``check``), or an observation without an entry that the
        rule reads, raise ``InputError``.
        """
        self.check(spec.options, per_agent=spec.per_agent)
        ranges = np.minimum(self._ranges(observations, spec), spec.actions.max_range)
        return spec.actions.from_ranges(ranges)

    def default_options(self, scenario: Scenario) -> dict[str, Any]:  # noqa: ARG002
        """Return one step per action, and ranges up to 100 m."""
        return {"max_range": _LONGEST, "steps_per_action": 1}

    @abstractmethod
    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        """Return the range in m of every row."""


@dataclass(eq=False, repr=False)
class StubbornLeaders(RangeRule):
    """A rule of thumb: agents that fly away from the predator stop listening; all others listen.

    rho_i = 0 if the cosine of the angle between the heading of agent i and the direction away from the
    predator exceeds ``min_cosine``, otherwise rho_i = ``interaction_range``. An agent that observes no
    predator listens. The rule requires one observation per agent.

    Args:
        min_cosine: cosine above which an agent stops listening.
        interaction_range: rho in m of agents that listen.
    """

    min_cosine: float = 0.8
    interaction_range: float = 10.0

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        # Directions are in the agent's frame, whose first axis is its heading.
        cosine_away = -observations[:, spec.layout.index("predator_direction_ahead")]
        return np.where(cosine_away > self.min_cosine, 0.0, self.interaction_range)


@dataclass(eq=False, repr=False)
class ListenWhileFleeing(RangeRule):
    """A rule for one range for the flock: all agents listen while the flock heads away from the predator.

    rho = ``interaction_range`` if the mean over agents of the cosine between heading and the direction away
    from the predator exceeds ``min_cosine``, otherwise rho = 0. Alignment then strengthens a good mean
    heading and never a bad one. The rule requires one observation per flock.

    Args:
        min_cosine: mean cosine above which all agents listen.
        interaction_range: rho in m while they listen.
    """

    per_agent = False
    min_cosine: float = 0.05
    interaction_range: float = 20.0

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        is_fleeing = observations[:, spec.layout.index("heading_away")] > self.min_cosine
        return np.where(is_fleeing, self.interaction_range, 0.0)


@dataclass(eq=False, repr=False)
class BestCandidate(RangeRule):
    """A rule for observations with a profile: the candidate range under which one entry is largest.

    Of equal candidates it sets the shortest. With ``"escape_cosine"`` an agent listens at the range at which
    the heard velocity points nearest to its escape direction; with ``"closest_approach"`` at the one whose
    heard heading keeps the predator farthest away. The rule requires one observation per agent.

    Args:
        entry: name of an entry of the candidates, without ``profile_k_``.
    """

    entry: str

    def __post_init__(self) -> None:
        as_text(self.entry, "entry")

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        return _best(_candidate_entries(self.entry, observations, spec), observations, spec)


@dataclass(eq=False, repr=False)
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
    """

    turn: float = 0.5

    def _ranges(self, observations: Observations, spec: PolicySpec) -> FloatArray:
        own = observations[:, [spec.layout.index("escape_direction_ahead")]].astype(np.float64)
        cosines = _candidate_entries("escape_cosine", observations, spec)
        prefixes = [f"profile_{k}_velocity_" for k in range(len(spec.profile_ranges))]
        heard = np.stack([vector_entries(prefix, observations, spec) for prefix in prefixes], axis=1)
        ahead = unit(unscaled(heard))[:, :, 0]
        lengths = np.sqrt(np.maximum(1 + 2 * self.turn * ahead + self.turn * self.turn, 1e-9))
        return _best((own + self.turn * cosines) / lengths, observations, spec)


def _candidate_entries(entry: str, observations: Observations, spec: PolicySpec) -> FloatArray:
    """Return an entry of every candidate range, shape (rows, candidates)."""
    if not spec.profile_ranges:
        raise InputError("profile_ranges", "candidate ranges", "none")
    columns = [spec.layout.index(f"profile_{k}_{entry}") for k in range(len(spec.profile_ranges))]
    values: FloatArray = observations[:, columns].astype(np.float64)
    return values


def _best(scores: FloatArray, observations: Observations, spec: PolicySpec) -> FloatArray:
    """Return the candidates with the best scores; 0 without a predator."""
    chosen = np.array(spec.profile_ranges)[scores.argmax(axis=1)]
    return np.where(observations[:, spec.layout.index("predator_sensed")] > 0, chosen, 0.0)


def vector_entries(prefix: str, observations: Observations, spec: PolicySpec) -> FloatArray:
    """Return the entries whose names begin with ``prefix``, shape (rows, axes)."""
    columns = [column for column, name in enumerate(spec.layout.names) if name.startswith(prefix)]
    vector: FloatArray = observations[:, columns].astype(np.float64)
    return vector


def unscaled(entries: FloatArray) -> FloatArray:
    """Return vectors, along the last axis, in units of the scale of their entries."""
    return entries / np.maximum(1 - _norm(entries), 1e-9)


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


class FlyStraight(BasePolicy):
    """A predator policy that flies straight on."""

    name, side = "fly-straight", "predator"

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Return an acceleration of 0 for every row; see ``Policy.act``."""
        return np.zeros((len(observations), spec.dimension), np.float32)


class Pursue(BasePolicy):
    """A predator policy that accelerates toward its target as strongly as possible.

    Args:
        target: ``"nearest"``: the agent nearest to the predator; ``"centroid"``: the mean position of all
            agents.
    """

    side = "predator"

    def __init__(self, target: Literal["nearest", "centroid"] = "nearest") -> None:
        self.target = as_choice(target, "target", ("nearest", "centroid"))
        self.name = "pursue" if target == "nearest" else f"pursue-{target}"

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> NDArray[Any]:
        """Return the direction toward the target for every row; see ``Policy.act``."""
        first = spec.layout.index(f"{self.target}_direction_ahead")
        return observations[:, first : first + spec.dimension]
