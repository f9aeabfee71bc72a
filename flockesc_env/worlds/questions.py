"""Does the paper's finding survive? Every world belongs to one question, by what its scenario is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from flockesc_env.scenario import FlockScenario

_STRAIGHT = "constant_velocity"
_BLIND = ("constant_velocity", "wandering")


def _steers(scenario: FlockScenario) -> bool:
    return any(predator.kind not in _BLIND for predator in scenario.predators)


def _misses_the_center(scenario: FlockScenario) -> bool:
    """Whether a predator flies straight past the center, by a quarter of the region's side or more."""
    center = np.full(2, scenario.initial_side / 2)
    for predator in scenario.predators:
        if predator.kind != _STRAIGHT:
            continue
        position, velocity = np.array(predator.position[:2]), np.array(predator.velocity[:2])
        (x, y), (u, v) = center - position, velocity
        speed = np.hypot(u, v)
        if speed > 0 and abs(u * y - v * x) / speed >= scenario.initial_side / 4:
            return True
    return False


QUESTIONS: Final[dict[str, Callable[[FlockScenario], bool]]] = {
    "another neighbor rule": lambda scenario: scenario.neighbor_rule.kind != "metric",
    "parameters that are drawn anew": lambda scenario: bool(scenario.randomization),
    "several predators that steer": lambda scenario: len(scenario.predators) > 1 and _steers(scenario),
    "a predator that steers": _steers,
    "an attack on the edge": _misses_the_center,
    "the paper's own setting": lambda scenario: scenario == FlockScenario(),
    "other flocks and predators": lambda _: True,
}
"""What differs from the paper, in order of precedence: a world belongs to the first that is true of it."""


def question_of(scenario: FlockScenario) -> str:
    """Return the question that a world answers."""
    return next(question for question, is_so in QUESTIONS.items() if is_so(scenario))
