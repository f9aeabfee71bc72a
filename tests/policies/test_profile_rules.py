"""Rules for a profile set the candidate range that a brute-force search finds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from option_table import small_flock

from flockesc_env import ConstantVelocity, Trajectory, parallel_env, simulate
from flockesc_env.policies import BestNextHeading, Policy, StepAside, bind

CANDIDATES = np.array([0.0, 8.0, 16.0, 32.0])
FAST, SLOW = np.array([10.0, 12.0]), np.array([5.0, 6.0])  # v0 is 10 m/s
OPTIONS: Any = {
    "profile_ranges": tuple(CANDIDATES),
    "predator_sensing_range": None,
    "extra_entries": ("escape_direction", "closest_approach"),
}
Array = NDArray[np.float64]


def steps(policy: Policy, predator: Array) -> Iterator[tuple[int, Trajectory, Array, Array]]:
    """Yield time, trajectory up to then, ranges up to then, and the ranges that the policy sets."""
    predators = (ConstantVelocity((-20.0, -10.0), tuple(predator)),)
    flock = small_flock(
        num_agents=20, num_steps=8, initial_side=60.0, predator_range=0.0, predators=predators
    )
    env = parallel_env(flock, action_mode="range", **OPTIONS)
    act = bind(policy, env)
    observations, _ = env.reset(seed=3)
    schedule = np.zeros((flock.num_steps, 20))
    for t in range(flock.num_steps):
        run = simulate(flock, schedule=schedule, seed=3)
        observations, _, _, _, infos = env.step(act(observations))
        ranges = np.array([info["interaction_range"] for info in infos.values()])
        yield t, run, schedule, ranges
        schedule[t] = ranges


def test_the_best_next_heading_is_the_best_of_all_simulated_ones() -> None:
    chosen: set[float] = set()
    for t, run, schedule, ranges in steps(BestNextHeading(turn=0.5), FAST):
        positions = run.positions[t] - run.predator_positions[t]
        velocities = run.velocities[t] - FAST
        time = max(0.0, -(positions * velocities).sum() / (velocities**2).sum())
        escape = positions - FAST * time
        escape /= np.linalg.norm(escape, axis=1, keepdims=True)
        cosines = []
        for candidate in CANDIDATES:
            schedule[t] = candidate
            following = simulate(run.scenario, schedule=schedule, seed=3).velocities[t + 1]
            cosines.append((following * escape).sum(axis=1))
        np.testing.assert_allclose(ranges, CANDIDATES[np.argmax(cosines, axis=0)], atol=1e-5)
        chosen.update(ranges.round())
    assert chosen == set(CANDIDATES)


@pytest.mark.parametrize("predator", [FAST, SLOW], ids=["faster than agents", "slower"])
def test_agents_step_aside_to_the_heading_with_the_largest_closest_approach(predator: Array) -> None:
    angles = np.linspace(0, 2 * np.pi, 3600, endpoint=False)
    headings = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    threatened = 0
    for t, run, _, ranges in steps(StepAside(aside_time=1e9, weight=1e9), predator):
        positions = run.positions[t] - run.predator_positions[t]
        relative = 10.0 * headings - predator
        approach = -positions @ relative.T
        times = np.maximum(approach / (relative**2).sum(axis=1), 0)
        distances = np.linalg.norm(positions[:, None] + relative * times[..., None], axis=2)
        best = headings[distances.argmax(axis=1)]
        hears = (
            np.linalg.norm(run.positions[t][:, None] - run.positions[t], axis=2) <= CANDIDATES[:, None, None]
        )
        heard = hears @ run.velocities[t]
        cosines = (heard * best).sum(axis=2) / np.linalg.norm(heard, axis=2)
        expected = CANDIDATES[cosines.argmax(axis=0)]
        # Others can keep their present distance with many headings.
        must_turn = distances.max(axis=1) < np.linalg.norm(positions, axis=1) - 1e-6
        threatened += must_turn.sum()
        np.testing.assert_allclose(ranges[must_turn], expected[must_turn], atol=1e-5)
    assert (threatened > 0) == (predator is FAST)
