"""Learned predators in every interface: official suites, bad actions and captures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as check_gymnasium
from option_table import DIMENSIONS, small_flock
from pettingzoo.test import api_test, parallel_api_test
from stable_baselines3.common.env_checker import check_env as check_sb3

import flockesc_env
from flockesc_env import (
    ConstantVelocity,
    FlockPursuitEnv,
    FlockScenario,
    Learned,
    PurePursuit,
    parallel_env,
)
from flockesc_env.common.errors import ActionError
from flockesc_env.policies import FixedRange, StubbornLeaders

TWO = (ConstantVelocity(), PurePursuit((40.0, 20.0), (-3.0, 1.0)))

# PettingZoo's suites pass options={"options": 1}.
pytestmark = pytest.mark.filterwarnings("ignore:reset\\(\\) ignores unknown options:UserWarning")

dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)
counts = pytest.mark.parametrize("count", [1, 2])
# Agents and predators have different observation spaces, which the suite advises against.
different_views = pytest.mark.filterwarnings(
    "ignore:Agents have different observation space sizes:UserWarning",
    "ignore:Observations are different shapes:UserWarning",
)


def hunted(dimension: int = 2, count: int = 1, **changes: Any) -> FlockScenario:
    return small_flock(dimension, predators=TWO[:count], **changes)


def sample(environment: Any) -> dict[str, Any]:
    return {agent: environment.action_space(agent).sample() for agent in environment.agents}


@counts
def test_arrays_equal_the_dicts(count: int) -> None:
    dicts, arrays = (parallel_env(hunted(2, count).with_learned_predators()) for _ in range(2))
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


def test_missing_and_unknown_predators() -> None:
    environment = parallel_env(hunted().with_learned_predators())
    environment.reset(seed=0)
    actions = sample(environment)
    for changed, field in (
        ({name: action for name, action in actions.items() if name != "predator_0"}, "predator_0"),
        ({**actions, "predator_1": actions["predator_0"]}, "predator_1"),
    ):
        with pytest.raises(ActionError) as caught:
            environment.step(changed)
        assert caught.value.field == f"action of {field!r}"
    alone = parallel_env(hunted())
    alone.reset(seed=0)
    with pytest.raises(ActionError, match="predator_actions"):
        alone.step_array(np.zeros((5, 1), np.float32), np.zeros((1, 2)))


@dimensions
@pytest.mark.parametrize(
    "options", [{}, {"per_agent": True, "reward": "individual_distance", "steps_per_action": 3}]
)
def test_pursuit_suites(dimension: int, options: dict[str, Any]) -> None:
    scenario = hunted(dimension)
    check_gymnasium(FlockPursuitEnv(scenario, **options), skip_render_check=True)
    check_sb3(FlockPursuitEnv(scenario, **options))


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


# A caught agent has no observation.
@pytest.mark.filterwarnings("ignore:Observation numpy array is all zeros:UserWarning")
@dimensions
@different_views
@pytest.mark.parametrize("radius", [4.0, 12.0, 500.0])
def test_predators_stay_while_agents_are_caught(dimension: int, radius: float) -> None:
    scenario = captured(dimension, capture_radius=radius)
    parallel_api_test(parallel_env(scenario), num_cycles=30)
    api_test(flockesc_env.env(scenario), num_cycles=30)
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
