"""``approach``: the paper's predator bit for bit, and the geometry of all others."""

import math
from itertools import product
from typing import Any

import numpy as np
import pytest

from flockesc_env import FlockScenario
from flockesc_env.scenario import ConstantVelocity, Intercept, approach, preset
from studies.paper.plan import OFFSETS, aimed

DIRECTIONS = [(1.0, 1.0), (0.0, -3.0), (-2.0, 0.5), (1.0, 1.0, 1.0), (0.0, -3.0, 4.0), (-2.0, 0.5, 0.0)]


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
@pytest.mark.parametrize("aim", ["center", "edge", "point", 0.0, 17.0, -5.0])
def test_the_path_misses_its_aim_by_the_offset(aim: Any, direction: tuple[float, ...]) -> None:
    """The whole region lies to the right of a path along the edge, and one corner lies on it."""
    dimension = len(direction)
    point, center = np.array([5.0, 6.0, 7.0])[:dimension], np.full(dimension, 15.0)
    options: dict[str, Any] = {"distance": 60.0, "speed": 7.0, "direction": direction, "initial_side": 30.0}
    given = approach(tuple(point) if aim == "point" else aim, dimension=dimension, **options)
    position, velocity = map(np.array, given)
    heading = np.array(direction) / np.linalg.norm(direction)
    assert velocity == pytest.approx(7.0 * heading)
    left = np.array([-heading[1], heading[0], 0.0])[:dimension] / np.linalg.norm(heading[:2])
    corners = np.array(list(product((-15.0, 15.0), repeat=dimension)))
    offset = {"center": 0.0, "edge": (corners @ left).max(), "point": 0.0}.get(aim, aim)
    target = point if aim == "point" else center
    assert position + 60.0 * heading == pytest.approx(target + offset * left)


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
