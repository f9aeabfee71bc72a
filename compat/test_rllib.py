"""RLlib trains on a slot per agent, and on the PettingZoo environment through its own wrapper."""

from __future__ import annotations

import math
import re
import runpy
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ray
import torch
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.single_agent_env_runner import SingleAgentEnvRunner
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune import register_env

from flockesc_env import FlockScenario, parallel_env

SCENARIO = FlockScenario(num_agents=4, num_steps=10)
OPTIONS: dict[str, Any] = {"reward": "individual_distance_change", "steps_per_action": 1}
EPISODES = 8
EXAMPLE = Path(__file__).parents[1] / "examples" / "rllib_ppo.py"


@pytest.fixture(scope="module", autouse=True)
def cluster() -> Iterator[None]:
    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def slots() -> PPOConfig:
    """Return PPO over two flocks with a slot per agent."""
    steps = 8 * SCENARIO.num_steps
    options = {"scenario": SCENARIO, **OPTIONS}
    return (
        PPOConfig()
        .environment("flockesc_env:flockesc/FlockAgents-v1", env_config=options)
        .env_runners(
            num_env_runners=0, num_envs_per_env_runner=8, gym_env_vectorize_mode="vector_entry_point"
        )
        .training(train_batch_size_per_learner=steps, minibatch_size=steps, num_epochs=1)
        .debugging(seed=5)
    )


def test_the_episodes_of_slots_are_those_of_the_agents() -> None:
    runner = SingleAgentEnvRunner(config=slots())
    episodes = runner.sample(num_episodes=8, random_actions=True)
    assert len(episodes) == 8
    for flock in range(2):
        own = episodes[4 * flock : 4 * flock + 4]
        plain = parallel_env(SCENARIO, **OPTIONS)
        first, _ = plain.reset_array(seed=5 + flock)
        np.testing.assert_array_equal([episode.observations[0] for episode in own], first)
        for step in range(SCENARIO.num_steps):
            actions = np.stack([episode.actions[step] for episode in own])
            rows, rewards, _, truncations, _ = plain.step_array(actions)
            np.testing.assert_array_equal([episode.observations[step + 1] for episode in own], rows)
            np.testing.assert_array_equal([episode.rewards[step] for episode in own], rewards)
        assert truncations.all()
        assert all(episode.is_truncated and not episode.is_terminated for episode in own)
    runner.stop()


def test_one_iteration_of_ppo_over_slots() -> None:
    algorithm = slots().build_algo()
    try:
        result = algorithm.train()
    finally:
        algorithm.stop()
    assert result["env_runners"]["num_episodes"] == 8
    assert result["env_runners"]["episode_len_mean"] == SCENARIO.num_steps
    assert math.isfinite(result["learners"]["default_policy"]["total_loss"])


def test_the_policy_of_the_example_acts_with_the_mean() -> None:
    example = runpy.run_path(str(EXAMPLE))
    algorithm = example["configure"]("slots", 1, 1, 0).build_algo()
    module = algorithm.get_module()
    spec = parallel_env(**example["OPTIONS"]).policy_spec
    rows = np.random.default_rng(0).uniform(-1, 1, (50, len(spec.layout.names))).astype(np.float32)
    outputs = module.forward_inference({"obs": torch.from_numpy(rows)})["action_dist_inputs"]
    actions = example["mean_action"](module).act(rows, spec)
    np.testing.assert_allclose(actions, outputs[:, :1].detach().numpy().clip(-1, 1), rtol=0, atol=1e-6)
    algorithm.stop()


def wrapped(_: Any = None) -> ParallelPettingZooEnv:
    return ParallelPettingZooEnv(parallel_env(SCENARIO, **OPTIONS))


def test_the_wrapper_returns_the_environments_results() -> None:
    env, plain = wrapped(), parallel_env(SCENARIO, **OPTIONS)
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


# RLlib registers its own environment once per algorithm.
@pytest.mark.filterwarnings("ignore:.*rllib-multi-agent-env-v0 already in registry:UserWarning")
@pytest.mark.parametrize("interface", ["slots", "pettingzoo"])
def test_the_example_trains(
    interface: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    short = ("--iterations", "1", "--flocks", "1", "--held-out", "3", "--interface", interface)
    monkeypatch.setattr(sys, "argv", ["rllib_ppo.py", *short])
    ray.shutdown()  # the example starts Ray itself
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    printed = capsys.readouterr().out
    assert re.search(r"^18000 samples in .* samples/s$", printed, re.MULTILINE)
    assert re.search(r"^[+-][\d.]+ m \[.*\] over the best fixed range$", printed, re.MULTILINE)
