"""Initial states from ``GivenPositions`` and ``GivenHeadings``."""

from typing import Any

import numpy as np
import pytest

import flockesc_env as fe
from flockesc_env.scenario import GivenHeadings, GivenPositions

RNG = np.random.default_rng(0)


def state(dimension: int) -> tuple[Any, Any]:
    return RNG.uniform(0, 100, (7, dimension)), RNG.normal(size=(7, dimension))


@pytest.mark.parametrize("dimension", [2, 3])
def test_given_points_set_the_start_bit_for_bit(dimension: int) -> None:
    positions, velocities = state(dimension)
    given: Any = {
        "initial_positions": GivenPositions(positions),
        "initial_headings": GivenHeadings(velocities),
    }
    scenario = fe.FlockScenario(num_agents=7, num_steps=5, dimension=dimension, **given)
    run = fe.simulate(scenario, 10.0, seed=1)
    np.testing.assert_array_equal(run.positions[0], positions)
    directions = velocities / np.linalg.norm(velocities, axis=1, keepdims=True)
    np.testing.assert_allclose(run.velocities[0], 10.0 * directions, rtol=1e-15)
    assert not run.is_start_given
    again = fe.simulate(scenario, 10.0, initial_positions=positions, initial_velocities=run.velocities[0])
    np.testing.assert_array_equal(run.positions, again.positions)
    assert fe.sweep(scenario, [10.0], [1]).min_mean_distance[0, 0] == run.mean_distance.min()


def test_points_of_the_plane_lie_at_z_0_in_space() -> None:
    positions, velocities = state(2)
    for in_plane in (False, True):
        scenario = fe.FlockScenario(
            num_agents=7,
            num_steps=1,
            dimension=3,
            initial_plane=in_plane,
            initial_positions=GivenPositions(positions),  # type: ignore[arg-type]
            initial_headings=GivenHeadings(velocities),  # type: ignore[arg-type]
        )
        run = fe.simulate(scenario, 10.0, seed=0)
        assert (run.positions[0, :, :2] == positions).all()
        assert not run.positions[0, :, 2].any()
        assert not run.velocities[0, :, 2].any()
