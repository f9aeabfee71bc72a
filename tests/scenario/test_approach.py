"""Where predators come from: the paper's to the last bit, and geometry for all others."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flockesc_env import ArgumentError, ConstantVelocity, FlockScenario, Intercept, approach
from studies.paper.plan import OFFSETS, aimed

DIRECTIONS = [(1.0, 1.0), (0.0, -3.0), (-2.0, 0.5)]


def test_the_default_is_the_papers_predator() -> None:
    assert ConstantVelocity(*approach()) == ConstantVelocity() == ConstantVelocity(*approach("center"))


@pytest.mark.parametrize("offset", OFFSETS)
def test_aimed_predators_are_those_of_the_measured_studies(offset: float) -> None:
    """Bit for bit: the names of finished jobs are hashes of the scenario."""
    sideways = offset / math.sqrt(2)
    (predator,) = aimed(offset).predators
    assert predator == ConstantVelocity((-30 - sideways, -30 + sideways), (10.0, 10.0))


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("aim", [0.0, 17.0, -5.0])
def test_the_path_misses_the_center_by_its_offset(aim: float, direction: tuple[float, float]) -> None:
    given = approach(aim, distance=60.0, speed=7.0, direction=direction, initial_side=30.0)
    position, velocity = map(np.array, given)
    heading = velocity / np.linalg.norm(velocity)
    assert np.linalg.norm(velocity) == pytest.approx(7.0)
    assert heading == pytest.approx(np.array(direction) / np.linalg.norm(direction))
    from_center = position - 15.0
    assert from_center @ heading == pytest.approx(-60.0)
    assert from_center @ np.array([-heading[1], heading[0]]) == pytest.approx(aim)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_the_edge_is_touched(direction: tuple[float, float]) -> None:
    """The whole region lies to the right of the path, and a corner on it."""
    position, velocity = map(np.array, approach("edge", direction=direction))
    corners = np.array([[x, y] for x in (0.0, 100.0) for y in (0.0, 100.0)]) - position
    left = (velocity[0] * corners[:, 1] - velocity[1] * corners[:, 0]) / np.linalg.norm(velocity)
    assert left.max() == pytest.approx(0.0, abs=1e-12)


def test_every_strategy_in_space_takes_it() -> None:
    scenario = FlockScenario(dimension=3, predators=(Intercept(*approach("edge")),))
    assert scenario.predators[0].position == approach("edge")[0]


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"aim": "middle"}, "aim"),
        ({"aim": None}, "aim"),
        ({"aim": np.nan}, "aim"),
        ({"distance": -1.0}, "distance"),
        ({"distance": "far"}, "distance"),
        ({"speed": -1.0}, "speed"),
        ({"speed": [1.0]}, "speed"),
        ({"direction": (0.0, 0.0)}, "direction"),
        ({"direction": (1.0, 0.0, 0.0)}, "direction"),
        ({"direction": (np.inf, 0.0)}, "direction[0]"),
        ({"initial_side": -100.0}, "initial_side"),
    ],
)
def test_bad_arguments(arguments: dict[str, Any], field: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        approach(**arguments)
    assert caught.value.field == field
