"""A predator on a prescribed path is at the positions of the path. The flock does not change them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from option_table import DIMENSIONS, small_flock

import flockesc_env as fe

STEPS = 60
INTERVALS = (None, 0.05, 0.013, 0.17, 1.0)
paths = pytest.mark.parametrize(
    ("dimension", "interval"), [(dimension, interval) for dimension in DIMENSIONS for interval in INTERVALS]
)


def track(dimension: int, count: int = 20) -> np.ndarray:
    """Return the positions of a random walk."""
    return np.cumsum(np.random.default_rng(dimension).normal(0, 5, (count, dimension)), axis=0)


def flown(points: np.ndarray, interval: float, times: np.ndarray) -> np.ndarray:
    """Return the positions at some times, extended straight on beyond the last one."""
    knots = interval * np.arange(len(points))
    inside = np.stack([np.interp(times, knots, column) for column in points.T], axis=1)
    late = np.maximum(times - knots[-1], 0)[:, np.newaxis]
    return inside + late * (points[-1] - points[-2]) / interval


def flock(dimension: int, interval: float | None, **changes: Any) -> fe.FlockScenario:
    path = fe.PrescribedPath(track(dimension), interval=interval)
    return small_flock(dimension, num_steps=STEPS, predators=(path,), capture_radius=3.0, **changes)


def expected(scenario: fe.FlockScenario) -> np.ndarray:
    path = scenario.predators[0]
    times = scenario.time_step * np.arange(scenario.num_steps + 1)
    return flown(np.array(path.positions), path.interval or scenario.time_step, times)


@pytest.mark.parametrize("interval", [None, 0.013])
def test_rounding_errors_do_not_accumulate(interval: float | None) -> None:
    scenario = flock(2, interval, time_step=0.007).replace(num_steps=100_000, num_agents=1)
    final, place = fe.simulate(scenario, 5.0, seed=1).predator_positions[-1, 0], expected(scenario)[-1]
    np.testing.assert_allclose(final, place, rtol=1e-13, atol=0)


@paths
def test_an_environment_and_a_snapshot_in_the_middle_follow_the_path(
    dimension: int, interval: float | None
) -> None:
    scenario = flock(dimension, interval)
    positions = expected(scenario)
    env, later = fe.FlockEscapeEnv(scenario), fe.FlockEscapeEnv(scenario)
    env.reset(seed=1)
    for step in range(STEPS):
        state = env.unwrapped.flock
        np.testing.assert_allclose(state.predator_positions[0], positions[step], rtol=0, atol=1e-9)
        velocity = (positions[step + 1] - positions[step]) / scenario.time_step
        np.testing.assert_allclose(state.predator_velocities[0], velocity, rtol=0, atol=1e-7)
        env.step([0.0])
        if step == STEPS // 2:
            later.set_state(env.get_state())
        elif step > STEPS // 2:
            later.step([0.0])
            assert later.get_state() == env.get_state()


GOOD = ((0.0, 0.0), (1.0, 2.0))


@pytest.mark.parametrize("name", ["predator_positions", "predator_velocities"])
def test_a_start_that_contradicts_the_path_is_refused(name: str) -> None:
    env = fe.FlockEscapeEnv(small_flock(predators=(fe.PurePursuit(), fe.PrescribedPath(GOOD))))
    with pytest.raises(fe.ArgumentError, match=r"predators\[1\] has a prescribed path") as caught:
        env.reset(options={name: np.zeros((2, 2))})
    assert caught.value.field == name
