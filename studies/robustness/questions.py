"""Questions about the paper's finding; a preset answers the first one that fits its scenario."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.predators import ConstantVelocity

_BLIND = ("constant_velocity", "wandering", "prescribed_path")


def _misses_the_center(scenario: FlockScenario) -> bool:
    """Whether a predator flies straight past the center, by a quarter of the region's side or more."""
    for predator in scenario.predators:
        if isinstance(predator, ConstantVelocity):
            x, y = scenario.initial_side / 2 - np.array(predator.position)[:2]
            u, v = np.array(predator.velocity)[:2]
            speed = np.hypot(u, v)
            if speed > 0 and abs(u * y - v * x) / speed >= scenario.initial_side / 4:
                return True
    return False


def _cooperate(scenario: FlockScenario) -> bool:
    return any(
        predator.kind in {"encircle", "herd"} or getattr(predator, "target", None) == "assigned"
        for predator in scenario.predators
    )


def _moves_otherwise(scenario: FlockScenario) -> bool:
    paper = FlockScenario()
    fields = ("motion", "angular_noise", "sensing_noise", "sensing_delay", "alignment_strength")
    return any(getattr(scenario, field) != getattr(paper, field) for field in fields)


QUESTIONS: Final[dict[str, Callable[[FlockScenario], bool]]] = {
    "the paper's own setting": lambda scenario: scenario == FlockScenario(),
    "an attack on the edge": _misses_the_center,
    "predators that catch agents": lambda scenario: scenario.capture_radius is not None,
    "predators that cooperate": _cooperate,
    "several predators on their own": lambda scenario: len(scenario.predators) > 1,
    "a predator that steers": lambda scenario: any(each.kind not in _BLIND for each in scenario.predators),
    "other neighbor rules": lambda scenario: (
        scenario.neighbor_rule.kind != "metric" or scenario.blind_angle > 0 or scenario.mutual
    ),
    "other laws of motion, noise, delay, unlike agents": _moves_otherwise,
    "controls: a frozen graph, no flight": lambda scenario: (
        scenario.frozen_graph or scenario.repulsion_strength == 0
    ),
    "parameters drawn for every episode": lambda scenario: bool(scenario.randomization),
    "other flocks and predators": lambda _: True,
}
"""How a scenario differs from the paper's, in order of precedence: the first true entry counts."""


def question_of(scenario: FlockScenario) -> str:
    """Return the question that a preset answers."""
    return next(question for question, is_so in QUESTIONS.items() if is_so(scenario))
