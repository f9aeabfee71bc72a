"""``approach``: the paper's predator bit for bit, and the geometry of all others."""

import math
from typing import Any

import numpy as np
import pytest

from flockesc_env import FlockScenario
from flockesc_env.scenario import ConstantVelocity, Intercept, approach, preset
from studies.paper.plan import OFFSETS, aimed

DIRECTIONS = [(1.0, 1.0), (0.0, -3.0), (-2.0, 0.5)]


def test_the_default_is_the_papers_predator() -> None:
    assert approach() == approach("center") == ((-30.0, -30.0), (10.0, 10.0))
    assert FlockScenario().predators == (ConstantVelocity(*approach()),)


@pytest.mark.parametrize("offset", OFFSETS)
def test_aimed_predators_equal_those_of_the_studies(offset: float) -> None:
    """Bit for bit, because jobs are named by a hash of the scenario."""
    sideways = offset / math.sqrt(2)
    (predator,) = aimed(offset).predators
    assert predator == ConstantVelocity((-30 - sideways, -30 + sideways), (10.0, 10.0))


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("aim", [0.0, 17.0, -5.0, "edge"])
def test_the_path_misses_the_center_by_its_offset(aim: Any, direction: tuple[float, float]) -> None:
    given = approach(aim, distance=60.0, speed=7.0, direction=direction, initial_side=30.0)
    position, velocity = map(np.array, given)
    heading = velocity / np.linalg.norm(velocity)
    assert np.linalg.norm(velocity) == pytest.approx(7.0)
    assert heading == pytest.approx(np.array(direction) / np.linalg.norm(direction))
    left, from_center = np.array([-heading[1], heading[0]]), position - 15.0
    assert from_center @ heading == pytest.approx(-60.0)
    # The whole region lies to the right of a path along the edge, and one corner lies on it.
    corners = np.array([[x, y] for x in (0.0, 30.0) for y in (0.0, 30.0)]) - 15.0
    assert from_center @ left == pytest.approx((corners @ left).max() if aim == "edge" else aim)


def test_only_the_direction_of_a_vector_counts() -> None:
    """Bit for bit, without overflow of squares, and without the last bit of ``math.hypot``."""
    for exponent in (-900, 0, 900):
        scaled = [math.ldexp(entry, exponent) for entry in (-2.0, 0.8)]
        _, velocity = approach(direction=scaled, speed=7.0)
        assert velocity == tuple(7.0 * entry / math.sqrt(2.0 * 2.0 + 0.8 * 0.8) for entry in (-2.0, 0.8))


def test_in_space_the_default_flies_along_the_diagonal() -> None:
    """Equal to the preset ``space`` bit for bit, with every strategy."""
    assert approach(dimension=3) == ((-30.0, -30.0, -30.0), (10.0, 10.0, 10.0))
    plain = FlockScenario(dimension=3)
    assert plain == preset("space") == FlockScenario(dimension=3, predators=(ConstantVelocity(),))
    assert FlockScenario(dimension=3, predators=(Intercept(),)).predators == (
        Intercept(*approach(dimension=3)),
    )
    half_given = FlockScenario(dimension=3, predators=(Intercept(velocity=(1.0, 2.0, 3.0)),))
    assert half_given.predators == (Intercept((-30.0, -30.0, -30.0), (1.0, 2.0, 3.0)),)


@pytest.mark.parametrize("direction", [(1.0, 1.0, 1.0), (0.0, -3.0, 4.0), (-2.0, 0.5, 0.0)])
@pytest.mark.parametrize("aim", ["center", "edge", 17.0, (5.0, 6.0, 7.0)])
def test_paths_in_space(aim: Any, direction: tuple[float, ...]) -> None:
    position, velocity = map(np.array, approach(aim, distance=60.0, direction=direction, dimension=3))
    heading = velocity / np.linalg.norm(velocity)
    assert heading == pytest.approx(np.array(direction) / np.linalg.norm(direction))
    assert np.linalg.norm(velocity) == pytest.approx(10 * math.sqrt(3))
    left = np.array([-heading[1], heading[0], 0.0]) / np.linalg.norm(heading[:2])
    target = np.array(aim if isinstance(aim, tuple) else (50.0, 50.0, 50.0))
    assert (position - target) @ heading == pytest.approx(-60.0)
    offset = {"edge": 50.0 * np.abs(left).sum(), 17.0: 17.0}.get(aim, 0.0)
    assert position - target + 60.0 * heading == pytest.approx(offset * left)
