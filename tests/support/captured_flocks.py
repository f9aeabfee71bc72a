"""Scenarios in which predators catch agents."""

from __future__ import annotations

from typing import Any

from option_table import small_flock

from flockesc_env import (
    ConstantVelocity,
    FlockScenario,
    Intercept,
    PurePursuit,
)

SIDE = 20.0
SEEDS = range(12)


def hunted(dimension: int = 2, **changes: Any) -> FlockScenario:
    """Return a flock in which three predators catch most agents at different times."""
    predators = (
        PurePursuit((-5.0, -5.0), (20.0, 20.0), max_turn_rate=4.0),
        Intercept((25.0, 0.0), (0.0, 15.0), max_turn_rate=3.0),
        ConstantVelocity((0.0, 25.0), (12.0, -12.0)),
    )
    fields = {
        "num_agents": 9,
        "num_steps": 25,
        "initial_side": SIDE,
        "capture_radius": 4.0,
        "predators": predators,
    }
    return small_flock(dimension, **{**fields, **changes})


def doomed(**changes: Any) -> FlockScenario:
    """Return a flock that may lose all agents before the horizon, at a time that depends on the seed."""
    return hunted(**{"num_agents": 3, "num_steps": 40, **changes})
