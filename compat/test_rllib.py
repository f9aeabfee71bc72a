"""RLlib trains on the PettingZoo environment through its own wrapper: one iteration of PPO."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest
import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune import register_env

from flockesc_env import FlockScenario, parallel_env

SCENARIO = FlockScenario(num_agents=4, num_steps=10)
EPISODES = 8


@pytest.fixture(scope="module", autouse=True)
def cluster() -> Iterator[None]:
    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def wrapped(_: Any = None) -> ParallelPettingZooEnv:
    return ParallelPettingZooEnv(parallel_env(SCENARIO, reward="individual_distance_change"))


def test_the_wrapper_returns_the_environments_results() -> None:
    env, plain = wrapped(), parallel_env(SCENARIO, reward="individual_distance_change")
    for each in (env, plain):
        each.reset(seed=3)
    done = {"__all__": False}
    steps = 0
    while not done["__all__"]:
        actions = {agent: plain.action_space(agent).sample() for agent in plain.agents}
        rewards, expected = env.step(actions)[1], plain.step(actions)[1]
        assert rewards == expected
        steps += 1
        done = {"__all__": not plain.agents}
    assert steps == SCENARIO.num_steps


def test_one_iteration_of_ppo() -> None:
    register_env("flock", wrapped)
    steps = EPISODES * SCENARIO.num_steps
    config = (
        PPOConfig()
        .environment("flock")
        .env_runners(num_env_runners=0)
        .multi_agent(policies={"shared"}, policy_mapping_fn=lambda *_, **__: "shared")
        .training(train_batch_size_per_learner=steps, minibatch_size=steps, num_epochs=1)
        .debugging(seed=0)
    )
    algorithm = config.build_algo()
    try:
        result = algorithm.train()
    finally:
        algorithm.stop()
    assert result["env_runners"]["num_episodes"] >= 1
    assert result["env_runners"]["episode_len_mean"] == SCENARIO.num_steps
    assert math.isfinite(result["env_runners"]["episode_return_mean"])
    assert math.isfinite(result["learners"]["shared"]["total_loss"])
