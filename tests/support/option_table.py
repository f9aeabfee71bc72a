"""Small flocks, and covering arrays of options: every combination of two values is in a row."""

import dataclasses
import math
from collections.abc import Iterable
from typing import Any, get_args

import gymnasium
import numpy as np
import pytest
from covertable import make

import flockesc_env as fe
from flockesc_env.scenario import ConstantVelocity, Intercept, PurePursuit, Uniform, Voronoi, Wandering
from flockesc_env.scenario.objectives import Objective
from flockesc_env.scenario.options import ActionMode, IndividualReward, LineReward, TeamReward
from flockesc_env.scenario.predators import PrescribedPath, Start

# Read from the schema, so that a new variant is tested without a change here.
ACTION_MODES = get_args(ActionMode)
OBJECTIVES = get_args(Objective)
FLOCK_REWARDS = get_args(TeamReward)
INDIVIDUAL_REWARDS = get_args(IndividualReward)
AGENT_REWARDS = FLOCK_REWARDS + INDIVIDUAL_REWARDS
SENSING_RANGES = (30.0, math.inf, 5.0)
STEPS_PER_ACTION = (1, 4, 7)
DIMENSIONS = (2, 3)
dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)
IDS = [
    name
    for name, spec in gymnasium.registry.items()
    if name.startswith("flockesc/") and "task" not in spec.kwargs
]
"""The ids of the environments, without those of the tasks."""
EVERY_STEP: dict[str, Any] = {"max_range": 100.0, "predator_sensing_range": 30.0, "steps_per_action": 1}
"""Options of an action per model step, of up to 100 m, by agents that see a predator within 30 m."""


# Five different agents with noise and delay.
UNLIKE: dict[str, Any] = {
    "mass": (0.1, 0.2, 0.3, 0.4, 0.5),
    "speed": (10.0, 8.0, 6.0, 4.0, 2.0),
    "repulsion_strength": (10.0, 0.0, 10.0, 5.0, 20.0),
    "alignment_strength": (0.0, 1.0, 1.0, 0.5, 2.0),
    "angular_noise": 1.0,
    "sensing_noise": 0.5,
    "sensing_delay": 2,
}


RANDOM = (
    Wandering((10.0, 10.0), (5.0, 0.0), angular_diffusion=2.0),
    PurePursuit((30.0, 0.0), (0.0, 9.0), confusion_rate=2.0),
)
"""Predators that draw random numbers."""


def covering(**values: Iterable[Any]) -> list[dict[str, Any]]:
    """Return rows of named values that contain each combination of two values of different names."""
    choices = {name: tuple(each) for name, each in values.items()}
    return [{name: row[name] for name in choices} for row in make(choices, strength=2)]


def every_pair(**values: Iterable[Any]) -> pytest.MarkDecorator:
    """Return a mark that runs a test over rows that contain every pair of values of two arguments."""
    rows = [tuple(row.values()) for row in covering(**values)]
    return pytest.mark.parametrize(tuple(values), rows)


AGENTS: dict[str, tuple[Any, ...]] = {
    "action_mode": ACTION_MODES,
    "objective": OBJECTIVES,
    "reward": AGENT_REWARDS,
    "predator_sensing_range": SENSING_RANGES,
    "steps_per_action": STEPS_PER_ACTION,
}
FLOCK = AGENTS | {"reward": FLOCK_REWARDS}
LINE = {"action_mode": ACTION_MODES, "reward": get_args(LineReward), "steps_per_action": STEPS_PER_ACTION}


def label(options: dict[str, Any]) -> str:
    return "-".join(str(value) for value in options.values())


def small_flock(dimension: int = 2, **changes: Any) -> fe.FlockScenario:
    """Return a flock that is small enough for thousands of steps, with the predator in range."""
    fields = {"num_agents": 5, "num_steps": 10, "initial_side": 30.0, "dimension": dimension}
    if "predators" in changes:
        changes["predators"] = tuple(embedded(predator, dimension) for predator in changes["predators"])
    return fe.FlockScenario(**{**fields, **changes})


def embedded(predator: Any, dimension: int) -> Any:
    """Return a predator that starts in the plane z = 0 of a space with the given dimension."""
    if isinstance(predator, PrescribedPath):
        positions = tuple((*position, 0.0)[:dimension] for position in predator.positions)
        return dataclasses.replace(predator, positions=positions)
    if not isinstance(predator, Start):
        return predator
    vectors = {"position": predator.position, "velocity": predator.velocity}
    padded = {name: (*vector, 0.0)[:dimension] for name, vector in vectors.items() if np.size(vector) == 2}
    return dataclasses.replace(predator, **padded)


def hunted(dimension: int = 2, **changes: Any) -> fe.FlockScenario:
    """Return a flock in which three predators catch most agents at different times."""
    predators = (
        PurePursuit((-5.0, -5.0), (20.0, 20.0), max_turn_rate=4.0),
        Intercept((25.0, 0.0), (0.0, 15.0), max_turn_rate=3.0),
        ConstantVelocity((0.0, 25.0), (12.0, -12.0)),
    )
    fields = {"num_agents": 9, "num_steps": 25, "initial_side": 20.0, "capture_radius": 4.0}
    return small_flock(dimension, **{**fields, "predators": predators, **changes})


def doomed(**changes: Any) -> fe.FlockScenario:
    """Return a flock that may lose all agents before the horizon, at a time that depends on the seed."""
    return hunted(**{"num_agents": 3, "num_steps": 40, **changes})


HUNTED = hunted(num_agents=5, num_steps=7, initial_side=30.0, capture_radius=6.0)
DRAWN = small_flock(
    num_steps=16, randomization=[Uniform("predator_range", 5.0, 25.0)], neighbor_rule=Voronoi()
)
SEVERAL = [small_flock(**UNLIKE), HUNTED, DRAWN, HUNTED]
"""Scenarios that differ as much as those of one batch may."""
