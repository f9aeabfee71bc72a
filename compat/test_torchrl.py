"""TorchRL collects episodes of the PettingZoo environment through its own wrapper."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torchrl.envs import PettingZooWrapper, check_env_specs
from torchrl.envs.utils import MarlGroupMapType

from flockesc_env import FlockScenario, parallel_env

# TorchRL warns about every PettingZoo version except one from 2023.
pytestmark = pytest.mark.filterwarnings("ignore:PettingZoo in TorchRL is tested:UserWarning")

SCENARIO = FlockScenario(num_agents=4, num_steps=10)


def wrapped() -> PettingZooWrapper:
    group_map = MarlGroupMapType.ALL_IN_ONE_GROUP
    return PettingZooWrapper(parallel_env(SCENARIO), group_map=group_map, use_mask=False)


def test_specs() -> None:
    check_env_specs(wrapped())


def test_a_rollout_equals_the_episode_of_the_environment() -> None:
    env, plain = wrapped(), parallel_env(SCENARIO)
    env.set_seed(3)
    torch.manual_seed(0)
    episode = env.rollout(100)
    assert episode.shape == (SCENARIO.num_steps,)
    actions = episode["agents", "action"].numpy()
    plain.reset(seed=3)
    plain.reset()  # because `set_seed` resets, and `rollout` resets again
    for step, each in enumerate(actions):
        observations, rewards, _, truncations, _ = plain.step(dict(zip(plain.agents, each, strict=True)))
        np.testing.assert_array_equal(
            episode["next", "agents", "observation"][step].numpy(), np.stack(list(observations.values()))
        )
        np.testing.assert_allclose(
            episode["next", "agents", "reward"][step, :, 0].numpy(),
            np.float32(list(rewards.values())),
            rtol=1e-6,
        )
        assert episode["next", "truncated"][step].item() == all(truncations.values())
