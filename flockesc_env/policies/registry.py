"""``NamedPolicy`` (a policy with its options) and the built-in policies."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, cast

from flockesc_env.common.checks import as_flag, as_instance, as_policy, as_seed, as_text, parse_number
from flockesc_env.common.errors import InputError, shown, shown_name
from flockesc_env.episodes.options import (
    PROFILE_RANGES,
    EnvOptionsDict,
    LineOptions,
    env_options,
    line_options,
)
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.base import Policy, StoredPolicy
from flockesc_env.policies.memory_rules import ListenWhileThreatened, StubbornWitnesses, WinStayLoseShift
from flockesc_env.policies.playing import record_flock
from flockesc_env.policies.ranges import FixedRange, RandomRange
from flockesc_env.policies.rules import BestCandidate, BestNextHeading, ListenWhileFleeing, StubbornLeaders
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_model, as_scenario

_EVERY_STEP: Final = {"max_range": 100.0, "steps_per_action": 1}
_LOCAL: Final = {"predator_sensing_range": 30.0}
_PROFILE: Final = {"profile_ranges": PROFILE_RANGES}
_ESCAPE: Final = {"extra_entries": ("escape_direction",)}
_APPROACH: Final = {"extra_entries": ("closest_approach",)}

_BUILT_IN: Final[dict[str, tuple[Callable[[], Policy], dict[str, Any]]]] = {
    "random": (lambda: RandomRange(0), {}),
    "stubborn-leaders": (StubbornLeaders, {}),
    "stubborn-leaders-local": (StubbornLeaders, _LOCAL),
    "stubborn-witnesses": (StubbornWitnesses, _LOCAL),
    "listen-while-fleeing": (ListenWhileFleeing, {}),
    "listen-while-threatened": (ListenWhileThreatened, {**_APPROACH, **_LOCAL, "max_range": 150.0}),
    "win-stay-lose-shift": (WinStayLoseShift, _APPROACH),
    "win-stay-lose-shift-escape": (
        lambda: WinStayLoseShift(10.0, 50.0, 0.85, 2.0, criterion="escape_direction"),
        _ESCAPE,
    ),
    "turn-away": (lambda: BestCandidate("escape_cosine"), {**_PROFILE, **_ESCAPE}),
    "keep-distance": (lambda: BestCandidate("closest_approach"), {**_PROFILE, **_APPROACH}),
    "head-away": (BestNextHeading, {**_PROFILE, **_ESCAPE}),
}
"""Constructor and options of each policy."""

NAMES = ("fixed:RHO", *_BUILT_IN)
"""Names of the built-in policies.

- ``fixed:RHO``: the fixed range RHO in m, for example ``fixed:10``.
- ``random``: a random range for every agent and action.
- ``stubborn-leaders``: ``StubbornLeaders``, with the predator visible at any distance.
- ``stubborn-leaders-local``: ``StubbornLeaders``, with the predator visible within 30 m only.
- ``stubborn-witnesses``: ``StubbornWitnesses``, with the predator visible within 30 m only.
- ``listen-while-fleeing``: ``ListenWhileFleeing``, one range for the flock, with the predator visible at any
  distance.
- ``listen-while-threatened``: ``ListenWhileThreatened``, with the predator visible within 30 m only.
- ``win-stay-lose-shift``: ``WinStayLoseShift``, with the predator visible at any distance.
- ``win-stay-lose-shift-escape``: the same with the criterion ``"escape_direction"``.
- ``turn-away``: ``BestCandidate("escape_cosine")``, with a profile and the predator visible at any distance.
- ``keep-distance``: ``BestCandidate("closest_approach")``, likewise.
- ``head-away``: ``BestNextHeading``, likewise.
"""


@dataclass(frozen=True)
class NamedPolicy:
    """A policy with its name and the environment options that it requires.

    Attributes:
        name: name in tables and figures.
        policy: the policy. One from a file is copied if its options differ from ``options``; the copy refuses
            environments with other options than these.
        per_agent: True: the policy sets one range per agent. False: one per flock.
        options: environment options, by the names of ``EnvOptions`` or, for a line, ``LineOptions``.
        scenario: the scenario in which the policy was trained; ``None``: none in particular.

    Raises:
        InputError: if an attribute has the wrong type, or the name contains control characters; if the policy
            was read from a file, and an option is unknown or out of bounds.
    """

    name: str
    policy: Policy
    per_agent: bool = False
    options: dict[str, Any] = field(default_factory=dict)
    scenario: FlockScenario | LineScenario | None = None

    def __post_init__(self) -> None:
        if not as_text(self.name, "name").isprintable():
            raise InputError("name", "printable characters", shown(self.name))
        as_policy(self.policy)
        object.__setattr__(self, "per_agent", as_flag(self.per_agent, "per_agent"))
        as_instance(self.options, "options", dict)
        if self.scenario is not None:
            as_model(self.scenario)
        if isinstance(self.policy, StoredPolicy) and (known := self.policy.options) is not None:
            is_line = isinstance(known, LineOptions)
            options = line_options(self.options) if is_line else env_options(FlockScenario(), self.options)
            if options != known or self.per_agent != self.policy.per_agent:
                policy = self.policy.with_options(options, per_agent=self.per_agent)
                object.__setattr__(self, "policy", policy)

    def record(self, seed: int, scenario: FlockScenario | str | None = None) -> Trajectory:
        """Run the policy on one flock and return the trajectory; see ``flockesc_env.record``.

        Args:
            seed: seed of the flock.
            scenario: the flock model's parameters, or a preset's name; default: the paper's.

        Raises:
            InputError: if the policy was trained on a line.
        """
        if isinstance(self.scenario, LineScenario):
            raise InputError("policy", "a policy for a flock", f"{self.name!r}, a policy for a line")
        flock = as_scenario(scenario, FlockScenario)
        options = env_options(flock, cast("EnvOptionsDict", self.options))
        return record_flock(self.policy, as_seed(seed), flock, options, per_agent=self.per_agent)


def built_in(name: str, argument: str = "policies") -> NamedPolicy:
    """Return a built-in policy by its name.

    Args:
        name: one of ``NAMES``, for example ``"random"`` or ``"fixed:10"``.
        argument: name of the argument, for the error message.

    Raises:
        InputError: if the name is unknown.
    """
    name = as_text(name, as_text(argument, "argument"))
    if name.startswith("fixed:"):
        rho = _range(name.removeprefix("fixed:"))
        if rho is not None:
            longest = max(rho, _EVERY_STEP["max_range"])
            return NamedPolicy(name, FixedRange(rho), options={**_EVERY_STEP, "max_range": longest})
    if name in _BUILT_IN:
        make, options = _BUILT_IN[name]
        policy = make()
        if isinstance(policy, RandomRange):  # it fits both views and all options
            return NamedPolicy(name, policy, per_agent=True)
        per_agent = getattr(policy, "per_agent", True)
        return NamedPolicy(name, policy, per_agent=per_agent, options={**_EVERY_STEP, **options})
    raise InputError(argument, f"one of {', '.join(NAMES)}", shown_name(name, NAMES))


def _range(text: str) -> float | None:
    """Return the number in a string, or ``None`` if it is not a finite number >= 0."""
    try:
        rho = parse_number(text, float)
    except ValueError:
        return None
    return rho if math.isfinite(rho) and rho >= 0 else None
