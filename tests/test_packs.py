"""Predators that hunt together: against the plain model over many steps, and what users expect of them."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import predator_reference
import pytest
import reference
from scipy.optimize import linear_sum_assignment

from flockesc_env import (
    ConstantVelocity,
    Encircle,
    FlockScenario,
    Herd,
    Intercept,
    PurePursuit,
    Trajectory,
    Wandering,
    simulate,
)

STEPS = 60
FAST = {"max_speed": 30.0, "acceleration": 8.0}

Starts = list[tuple[np.ndarray, np.ndarray]]

PACKS: dict[str, Any] = {
    "straight": lambda s: [ConstantVelocity(*s[0])],
    "nearest": lambda s: [PurePursuit(*s[0]), PurePursuit(*s[1], 0.4, **FAST)],
    "centroid": lambda s: [PurePursuit(*s[0], target="centroid", **FAST)],
    "most isolated": lambda s: [PurePursuit(*s[0], target="most_isolated", **FAST)],
    "assigned": lambda s: [PurePursuit(*start, 2.0, "assigned", **FAST) for start in s],
    "intercept": lambda s: [Intercept(*s[0]), Intercept(*s[1], 2.0, 4.0, **FAST)],
    "confused": lambda s: [PurePursuit(*start, confusion_rate=0.5) for start in s],
    "wandering": lambda s: [Wandering(*start, 1.0) for start in s],
    "encircle": lambda s: [Encircle(*start, radius=25.0, **FAST) for start in s],
    "closing in": lambda s: [Encircle(*start, radius=25.0, closing_speed=12.0) for start in s],
    "herd": lambda s: [PurePursuit(*s[0]), Herd(*s[1], distance=20.0, **FAST), Herd(*s[2], partner=1)],
    "all at once": lambda s: [
        Wandering(*s[0], 1.0),
        PurePursuit(*s[1], target="assigned"),
        Herd(*s[2], partner=1, **FAST),
        PurePursuit(*s[3], confusion_rate=0.5),
        PurePursuit(*s[4], target="assigned", **FAST),
        Encircle(*s[5], radius=10.0),
        Encircle(*s[6], radius=20.0),
    ],
}
every_pack = pytest.mark.parametrize("pack", PACKS)
dimensions = pytest.mark.parametrize("dimension", [2, 3])


def drawn(dimension: int, seed: int, agents: int = 30) -> tuple[Starts, dict[str, np.ndarray]]:
    """Draw predators and a flock in the same place, so that they are felt from the first step on."""
    rng = np.random.default_rng(seed)
    starts = [(rng.normal(0, 25, dimension), rng.normal(0, 6, dimension)) for _ in range(7)]
    start = {
        "initial_positions": rng.normal(0, 20, (agents, dimension)),
        "initial_velocities": rng.normal(0, 6, (agents, dimension)),
    }
    return starts, start


def hunt(predators: Any, start: dict[str, np.ndarray], **changes: Any) -> Trajectory:
    agents, dimension = start["initial_positions"].shape
    fields = {"num_agents": agents, "dimension": dimension, "num_steps": STEPS, "predators": tuple(predators)}
    return simulate(FlockScenario(**{**fields, **changes}), 7.3, seed=5, **start)


@every_pack
@dimensions
@pytest.mark.parametrize("agents", [1, 3, 30])
def test_packs_follow_the_plain_model(pack: str, dimension: int, agents: int) -> None:
    """Rounding grows along a run: near 1e-10 m at its end, and less than that wherever an agent is chosen."""
    starts, start = drawn(dimension, agents + dimension, agents)
    run = hunt(PACKS[pack](starts), start)
    state = reference.flock_start(run.scenario, run.positions[0], run.velocities[0], run.seed)
    for t in range(STEPS + 1):
        close = {"rtol": 0, "atol": 1e-7, "err_msg": f"step {t}"}
        np.testing.assert_allclose(run.predator_positions[t], state.predator_positions, **close)
        np.testing.assert_allclose(run.positions[t], state.positions, **close)
        distances = reference.predator_distances(state.positions, state.predator_positions)
        np.testing.assert_allclose(run.mean_distance[t], distances.mean(), **close)
        state = reference.flock_step(run.scenario, state, np.full(agents, 7.3))
