"""Learned predators as agents: arrays, a fixed flock, and captures. Official suites: test_conformance.py."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from option_table import DIMENSIONS, small_flock

from flockesc_env import (
    ConstantVelocity,
    FlockPursuitEnv,
    FlockScenario,
    Learned,
    PurePursuit,
    parallel_env,
)
from flockesc_env.policies import FixedRange, StubbornLeaders

TWO = (ConstantVelocity(), PurePursuit((40.0, 20.0), (-3.0, 1.0)))

dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)


def hunted(dimension: int = 2, count: int = 1, **changes: Any) -> FlockScenario:
    return small_flock(dimension, predators=TWO[:count], **changes)


def sample(environment: Any) -> dict[str, Any]:
    return {agent: environment.action_space(agent).sample() for agent in environment.agents}


def test_arrays_equal_the_dicts() -> None:
    dicts, arrays = (parallel_env(hunted(2, 2).with_learned_predators()) for _ in range(2))
    observations, _ = dicts.reset(seed=2)
    _, info = arrays.reset_array(seed=2)
    while dicts.agents:
        seen = [row for name, row in observations.items() if name.startswith("predator")]
        np.testing.assert_array_equal(info["predator_observations"], seen)
        actions = sample(dicts)
        values = list(actions.values())
        rows, rewards, *_, info = arrays.step_array(np.stack(values[:5]), np.stack(values[5:]))
        observations, paid, *_ = dicts.step(actions)
        np.testing.assert_array_equal(rows, [observations[f"agent_{i}"] for i in range(5)])
        np.testing.assert_array_equal(rewards, [paid[f"agent_{i}"] for i in range(5)])


@dimensions
@pytest.mark.parametrize("per_agent", [False, True])
def test_pursuit_is_the_parallel_environment_with_a_fixed_flock(dimension: int, per_agent: bool) -> None:
    scenario = hunted(dimension)
    policy = StubbornLeaders() if per_agent else FixedRange(10.0)
    pursuit = FlockPursuitEnv(scenario, flock_policy=policy, per_agent=per_agent)
    parallel = parallel_env(scenario.with_learned_predators())
    observation, _ = pursuit.reset(seed=5)
    observations, _ = parallel.reset(seed=5)
    while parallel.agents:
        np.testing.assert_array_equal(observation, observations["predator_0"])
        flock = np.stack([observations[f"agent_{i}"] for i in range(5)])
        ranges = policy.act(flock, parallel.policy_spec)
        action = pursuit.action_space.sample()
        observation, reward, terminated, truncated, info = pursuit.step(action)
        actions = {f"agent_{i}": rho for i, rho in enumerate(ranges)} | {"predator_0": action}
        observations, rewards, terminations, truncations, infos = parallel.step(actions)
        assert (reward, terminated, truncated, info) == tuple(
            part["predator_0"] for part in (rewards, terminations, truncations, infos)
        )


def captured(dimension: int = 2, **changes: Any) -> FlockScenario:
    """Return a flock with two predators in its middle, which catch the agents nearby."""
    hunters = (Learned((10.0, 10.0), (5.0, 0.0)), Learned((20.0, 20.0), (0.0, -5.0)))
    fields = {"capture_radius": 12.0, "num_agents": 12, "predators": hunters}
    return small_flock(dimension, **{**fields, **changes})


@dimensions
@pytest.mark.parametrize("radius", [4.0, 12.0, 500.0])
def test_predators_stay_while_agents_are_caught(dimension: int, radius: float) -> None:
    scenario = captured(dimension, capture_radius=radius)
    for reward in ("running_minimum", "distance", "individual_distance"):
        environment, arrays = (parallel_env(scenario, reward=reward) for _ in range(2))
        environment.reset(seed=1)
        arrays.reset_array(seed=1)
        while environment.agents:
            before = environment.agents
            assert before[-2:] == ["predator_0", "predator_1"]
            actions = sample(environment)
            flock = np.zeros((12, 1), np.float32)
            for agent in before[:-2]:
                flock[int(agent.removeprefix("agent_"))] = actions[agent]
            hunters = np.stack([actions[agent] for agent in before[-2:]])
            _, together, *_ = arrays.step_array(flock, hunters)
            observations, rewards, terminations, truncations, _ = environment.step(actions)
            paid = [rewards[agent] for agent in before[:-2]]
            mean = np.mean(together) if reward.startswith("individual_") else paid[0]
            assert rewards["predator_0"] == rewards["predator_1"] == pytest.approx(-mean, abs=1e-12)
            for name in before[-2:]:
                assert environment.observation_space(name).contains(observations[name])
            survivors = [agent for agent in before[:-2] if not terminations[agent]]
            assert terminations["predator_0"] is (not survivors)
            assert truncations["predator_0"] is (not environment.agents and bool(survivors))
            assert environment.agents in ([], [*survivors, "predator_0", "predator_1"])
    if radius == 500.0:
        assert terminations["predator_1"]
