"""Arguments that contradict each other: errors name the argument (single ones: ``test_arguments``)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from option_table import small_flock

from flockesc_env import (
    FlockescError,
    LineScenario,
    simulate,
)
from flockesc_env.common.errors import ArgumentError

FLOCK, LINE = small_flock(), LineScenario(num_agents=5, max_steps=10)
NAN = np.nan
POSITIONS = np.zeros((5, 2))
SPOILT = POSITIONS.copy()
SPOILT[3, 1] = np.inf


def refusal(call: Callable[[], Any]) -> ArgumentError:
    """Return the error that a call raises, after checking that it has the package's form."""
    with pytest.raises(ArgumentError) as caught:
        call()
    error = caught.value
    assert isinstance(error, FlockescError)
    assert isinstance(error, ValueError)
    assert str(error) == f"{error.field}: expected {error.expected}, got {error.given}"
    return error


SIMULATE: list[tuple[Any, dict[str, Any], str]] = [
    ([1, 1, 1, 1, -1], {}, "interaction_range[4]"),
    ([1, 1, NAN, 1, 1], {}, "interaction_range[2]"),
    (np.ones((10, 5)), {}, "interaction_range"),
    (1.0, {"schedule": np.ones((10, 5))}, "interaction_range"),
    (None, {"schedule": np.ones((5, 10))}, "schedule"),
    (None, {"schedule": np.ones((10, 4))}, "schedule"),
    (None, {"schedule": np.ones((10, 5, 1))}, "schedule"),
    (None, {"schedule": np.ones(10)}, "schedule"),
    (1.0, {"initial_positions": POSITIONS.T}, "initial_positions"),
    (1.0, {"initial_positions": SPOILT}, "initial_positions[3, 1]"),
    (1.0, {"initial_positions": np.full((5, 2), 1e30)}, "initial_positions[0, 0]"),
    (1.0, {"initial_velocities": SPOILT}, "initial_velocities[3, 1]"),
]


@pytest.mark.parametrize(("rho", "arguments", "field"), SIMULATE)
def test_simulate(rho: Any, arguments: dict[str, Any], field: str) -> None:
    assert refusal(lambda: simulate(FLOCK, rho, seed=0, **arguments)).field == field


def test_schedule_or_range_per_agent() -> None:
    """With as many agents as steps, the name of the argument decides which axis an array has."""
    scenario = small_flock(num_agents=6, num_steps=6)
    values = np.arange(6) * 10.0
    own = simulate(scenario, values, seed=0)
    scheduled = simulate(scenario, schedule=values[:, None], seed=0)
    assert own.num_components[0] < 6  # the scheduled range starts at 0
    assert scheduled.num_components[0] == 6
    square = np.tile(values, (6, 1))
    np.testing.assert_array_equal(simulate(scenario, schedule=square, seed=0).positions, own.positions)
    lonely = small_flock(num_agents=1, num_steps=1)
    np.testing.assert_array_equal(
        simulate(lonely, [3.0], seed=0).positions, simulate(lonely, 3.0, seed=0).positions
    )
