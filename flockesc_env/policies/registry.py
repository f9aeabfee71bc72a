"""Built-in policies by name, each with the view and the options that it is made for."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from flockesc_env.common.checks import as_flag, as_instance, as_policy, as_text
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.ranges import FixedRange, Policy, RandomRange, StubbornLeaders, StubbornWitnesses
from flockesc_env.policies.rollout import record
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_model

NAMES = ("fixed:RHO", "random", "stubborn-leaders", "stubborn-leaders-local", "stubborn-witnesses")
"""What ``built_in`` knows: the same range rho in m for all, ranges at random, the rule of thumb with the
predator visible at any distance, or only within its range, and the rule made for the latter."""


@dataclass(frozen=True)
class NamedPolicy:
    """A policy with the view and the options that it was made for.

    Attributes:
        name: how tables and figures call it.
        policy: the policy.
        per_agent: whether it sets one range per agent.
        options: environment options (``EnvOptions`` or, for a line, ``LineOptions``).
        scenario: what it was trained in; ``None``: nothing in particular.

    Raises:
        ArgumentError: naming the attribute of a wrong type.
    """

    name: str
    policy: Policy
    per_agent: bool = False
    options: dict[str, Any] = field(default_factory=dict)
    scenario: FlockScenario | LineScenario | None = None

    def __post_init__(self) -> None:
        as_text(self.name, "name")
        as_policy(self.policy)
        object.__setattr__(self, "per_agent", as_flag(self.per_agent, "per_agent"))
        as_instance(self.options, "options", dict)
        if self.scenario is not None:
            as_model(self.scenario)

    def record(self, seed: int, scenario: FlockScenario | None = None) -> Trajectory:
        """Run the policy on one flock and record all of it; see ``flockesc_env.record``.

        Raises:
            ArgumentError: if it was trained on a line.
        """
        if isinstance(self.scenario, LineScenario):
            raise ArgumentError("policy", "one for a flock", f"one for a line, {self.name}")
        return record(self.policy, seed, scenario=scenario, per_agent=self.per_agent, **self.options)


def built_in(name: str, argument: str = "policies") -> NamedPolicy:
    """Make a contender of a built-in policy's name.

    Args:
        name: one of ``NAMES``, with a number for RHO.
        argument: what an error calls the argument that the name came in.

    Raises:
        ArgumentError: if there is no such policy.
    """
    name = as_text(name, as_text(argument, "argument"))
    if name.startswith("fixed:"):
        rho = _range(name.removeprefix("fixed:"))
        if rho is not None:
            return NamedPolicy(name, FixedRange(rho), options={"max_range": max(rho, EnvOptions.max_range)})
    if name == "random":
        return NamedPolicy(name, RandomRange(0), per_agent=True)
    if name == "stubborn-leaders":
        return NamedPolicy(name, StubbornLeaders(), per_agent=True, options={"predator_sensing_range": None})
    if name == "stubborn-leaders-local":
        return NamedPolicy(name, StubbornLeaders(), per_agent=True)
    if name == "stubborn-witnesses":
        return NamedPolicy(name, StubbornWitnesses(), per_agent=True, options={"steps_per_action": 1})
    raise ArgumentError(argument, f"one of {', '.join(NAMES)}", shown(name))


def _range(text: str) -> float | None:
    """Return a range in m, or ``None`` if the text is none."""
    try:
        rho = float(text)
    except ValueError:
        return None
    return rho if math.isfinite(rho) and rho >= 0 else None
