"""Runs of a million steps: the invariants of one step hold after all of them."""

from typing import Any

import numpy as np
import pytest
from option_table import dimensions, small_flock

import flockesc_env as fe
from flockesc_env.scenario import Inertial, PurePursuit, Reynolds, Vicsek, Wandering

STEPS = 10**6


HUNTERS = (
    Wandering((0.0, 9.0), (5.0, 5.0), angular_diffusion=1.0),
    PurePursuit((9.0, 0.0), (6.0, 6.0), confusion_rate=3.0),
    PurePursuit((9.0, 9.0), (1.0, 6.0), max_speed=30.0, acceleration=0.01),
)


@dimensions
@pytest.mark.parametrize(
    ("motion", "constant_speed"),
    [(Inertial(), True), (Inertial(), False), (Vicsek(), True), (Reynolds(), True), (Reynolds(), False)],
    ids=lambda value: getattr(value, "kind", value),
)
def test_a_million_steps(motion: Any, constant_speed: bool, dimension: int) -> None:
    """All numbers stay finite, observations stay in their space, speeds are constant, minima never rise."""
    fields = {"motion": motion, "constant_speed": constant_speed, "angular_noise": 0.1}
    scenario = small_flock(dimension, num_steps=STEPS, predators=HUNTERS, **fields)
    env = fe.FlockEscapeEnv(scenario, action_mode="range", steps_per_action=5000)
    env.reset(seed=1)
    least, has_ended = np.inf, False
    while not has_ended:
        observation, reward, _, has_ended, info = env.step([10.0])
        flock = env.flock
        assert env.observation_space.contains(observation)
        assert np.isfinite([reward, *info.values()]).all()
        assert info["min_mean_distance"] <= least
        least = info["min_mean_distance"]
        for name in ("positions", "velocities", "predator_positions", "predator_velocities"):
            assert np.isfinite(getattr(flock, name)).all()
        if constant_speed:
            np.testing.assert_allclose(np.linalg.norm(flock.velocities, axis=1), 10.0, rtol=1e-12)
        speeds = np.linalg.norm(flock.predator_velocities, axis=1)
        assert speeds[2] <= 30.0 * (1 + 1e-12)
        np.testing.assert_allclose(speeds[:2], [50**0.5, 72**0.5], rtol=1e-12)
    assert env.flock.step == STEPS
