"""Policies with a name: what they were made for, and the built-in ones."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, cast

from flockesc_env.common.checks import as_flag, as_instance, as_policy, as_seed, as_text
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.options import EnvOptions, EnvOptionsDict, env_options
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.base import Policy
from flockesc_env.policies.playing import record_flock
from flockesc_env.policies.ranges import FixedRange, RandomRange
from flockesc_env.policies.rules import StubbornLeaders, StubbornWitnesses
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_model, as_scenario

NAMES = ("fixed:RHO", "random", "stubborn-leaders", "stubborn-leaders-local", "stubborn-witnesses")
"""Names that ``built_in`` knows: one range RHO in m for all agents; random ranges; the rule of thumb with the
predator visible at any distance, or only within its range; and the rule made for the latter."""


@dataclass(frozen=True)
class NamedPolicy:
    """A policy with its name, and the view and options that it was made for.

    Attributes:
        name: how tables and figures call it.
        policy: the policy.
        per_agent: whether it sets one range per agent.
        options: environment options (``EnvOptions`` or, for a line, ``LineOptions``).
        scenario: the scenario that it was trained in; ``None``: no particular one.

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

    def record(self, seed: int, scenario: FlockScenario | str | None = None) -> Trajectory:
        """Run the policy on one flock and return all of it; see ``flockesc_env.record``.

        Args:
            seed: seed of the flock.
            scenario: the flock model's parameters, or a preset's name; default: the paper's.

        Raises:
            ArgumentError: if it was trained on a line.
        """
        if isinstance(self.scenario, LineScenario):
            raise ArgumentError("policy", "one for a flock", f"one for a line, {self.name}")
        flock = as_scenario(scenario, FlockScenario)
        options = env_options(flock, cast("EnvOptionsDict", self.options))
        return record_flock(self.policy, as_seed(seed), flock, options, per_agent=self.per_agent)


def built_in(name: str, argument: str = "policies") -> NamedPolicy:
    """Return a built-in policy by its name.

    Args:
        name: one of ``NAMES``, with a number for RHO.
        argument: name of the argument in an error.

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
    """Return a range in m, or ``None`` if the text is not a finite number >= 0."""
    try:
        rho = float(text)
    except ValueError:
        return None
    return rho if math.isfinite(rho) and rho >= 0 else None
