"""The rule ``BestNextHeading`` sets the candidate range that a brute-force search finds."""

from __future__ import annotations

from typing import Any

import numpy as np
from option_table import small_flock

import flockesc_env as fe
from flockesc_env.policies import BestNextHeading, bind

CANDIDATES = np.array([0.0, 8.0, 16.0, 32.0])
PREDATOR = np.array([10.0, 12.0])  # v0 is 10 m/s
OPTIONS: Any = {
    "profile_ranges": tuple(CANDIDATES),
    "predator_sensing_range": None,
    "extra_entries": ("escape_direction", "closest_approach"),
}


def test_the_best_next_heading_is_the_best_of_all_simulated_ones() -> None:
    predators = (fe.ConstantVelocity((-20.0, -10.0), tuple(PREDATOR)),)
    flock = small_flock(
        num_agents=20, num_steps=8, initial_side=60.0, predator_range=0.0, predators=predators
    )
    env = fe.parallel_env(flock, action_mode="range", **OPTIONS)
    act = bind(BestNextHeading(turn=0.5), env)
    observations, _ = env.reset(seed=3)
    schedule = np.zeros((flock.num_steps, 20))
    chosen: set[float] = set()
    for t in range(flock.num_steps):
        run = fe.simulate(flock, schedule=schedule, seed=3)
        observations, _, _, _, infos = env.step(act(observations))
        ranges = np.array([info["interaction_range"] for info in infos.values()])
        positions = run.positions[t] - run.predator_positions[t]
        velocities = run.velocities[t] - PREDATOR
        time = max(0.0, -(positions * velocities).sum() / (velocities**2).sum())
        escape = positions - PREDATOR * time
        escape /= np.linalg.norm(escape, axis=1, keepdims=True)
        cosines = []
        for candidate in CANDIDATES:
            schedule[t] = candidate
            following = fe.simulate(flock, schedule=schedule, seed=3).velocities[t + 1]
            cosines.append((following * escape).sum(axis=1))
        np.testing.assert_allclose(ranges, CANDIDATES[np.argmax(cosines, axis=0)], atol=1e-5)
        chosen.update(ranges.round())
        schedule[t] = ranges
    assert chosen == set(CANDIDATES)
