"""Training with stable-baselines3 runs on the vector environments and is reproducible."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from option_table import small_flock
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

from flockesc_env import rollout
from flockesc_env.policies import SB3Policy, bind
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

SCENARIO = small_flock(num_agents=4)


def trained(make: type[VecEnv], rounds: int = 2, seed: int = 0, action_mode: str = "normalized") -> PPO:
    env = make(2, SCENARIO, action_mode=action_mode)
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=2, seed=seed, device="cpu")
    return model.learn(32 * env.num_envs * rounds) if rounds else model


@pytest.mark.parametrize("make", [FlockVecEnv, AgentVecEnv])
def test_training_is_reproducible_and_gives_a_policy(make: type[VecEnv]) -> None:
    model = trained(make)
    again, other, untrained = (
        candidate.policy.state_dict()
        for candidate in (trained(make), trained(make, seed=1), trained(make, rounds=0))
    )
    weights = model.policy.state_dict()
    for name, weight in weights.items():
        assert torch.isfinite(weight).all()
        assert torch.equal(weight, again[name])
    for changed in (other, untrained):
        assert any(not torch.equal(weight, changed[name]) for name, weight in weights.items())
    assert trained(make, action_mode="discrete").num_timesteps > 0

    policy, env = SB3Policy(model), make(2, SCENARIO)
    env.seed(0)
    act, observations, total = bind(policy, env), env.reset(), np.zeros(env.num_envs)
    for _ in range(SCENARIO.num_steps):
        observations, rewards, _, _ = env.step(act(observations))
        total += rewards
    episodes = rollout(SCENARIO, policy, [0, 1], per_agent=make is AgentVecEnv)
    np.testing.assert_allclose(episodes.mean_return, total.reshape(2, -1).mean(axis=1), atol=1e-4)
