"""Rollouts of the line equal the episodes of the environment and the runs of a sweep."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flockesc_env import LineEscapeEnv, LineScenario, rollout
from flockesc_env.policies import FixedRange, Policy, bind
from flockesc_env.policies.network import Architecture, NetworkPolicy

SCENARIO = LineScenario(num_agents=12, max_steps=40)
SEEDS = [5, 0, 2**64 - 1, 7, 7, 3]


def by_time_and_offsets() -> Policy:
    architecture = Architecture(("time", "escape_distance", "offset_0", "offset_11"), (5,), memory=1)
    return NetworkPolicy(architecture, np.random.default_rng(2).normal(0, 2, architecture.size))


def fixed() -> Policy:
    return FixedRange(0.125)


def one_by_one(policy: Policy, scenario: LineScenario, **options: Any) -> dict[str, list[Any]]:
    env = LineEscapeEnv(scenario, **options)
    act, found = bind(policy, env), []
    for seed in SEEDS:
        observation, info = env.reset(seed=seed)
        terminated = truncated = False
        while not (terminated or truncated):
            observation, _, terminated, truncated, info = env.step(act(observation))
        found.append((info["escape_distance"], info["num_components"], terminated, observation[0]))
    names = ("escape_distance", "num_components", "converged", "time")
    return dict(zip(names, map(list, zip(*found, strict=True)), strict=True))


@pytest.mark.parametrize("make", [by_time_and_offsets, fixed])
@pytest.mark.parametrize("steps_per_action", [1, 3])
@pytest.mark.parametrize("batch_size", [1, 4, 6, 100])
def test_it_equals_the_environment_line_by_line(make: Any, steps_per_action: int, batch_size: int) -> None:
    options = {"steps_per_action": steps_per_action, "max_range": 0.5}
    expected = one_by_one(make(), SCENARIO, **options)
    found = rollout(SCENARIO, make(), SEEDS, batch_size=batch_size, **options)
    assert found.seeds.tolist() == SEEDS
    assert found.num_components.tolist() == expected["num_components"]
    assert found.converged.tolist() == expected["converged"]
    np.testing.assert_array_equal((found.steps / SCENARIO.max_steps).astype(np.float32), expected["time"])
    # A network's sums may round differently if there are fewer rows.
    np.testing.assert_allclose(found.escape_distance, expected["escape_distance"], rtol=0, atol=1e-6)
    assert len({*found.steps.tolist()}) > 1  # lines end at different times


def test_an_ended_line_keeps_its_row_and_is_not_stepped() -> None:
    rows: list[np.ndarray] = []

    class Watching:
        def act(self, observations: np.ndarray, spec: Any) -> np.ndarray:
            rows.append(observations.copy())
            return FixedRange(0.125).act(observations, spec)

    found = rollout(SCENARIO, Watching(), SEEDS)
    assert len(rows) == found.steps.max()
    for line, steps in enumerate(found.steps):
        last = [row[line] for row in rows[steps:]]
        assert all((row == last[0]).all() for row in last)
        assert len({row[line, 0] for row in rows[: steps + 1]}) == min(steps + 1, len(rows))
