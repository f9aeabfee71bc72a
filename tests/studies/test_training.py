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

ENVS = pytest.mark.parametrize("make", [FlockVecEnv, AgentVecEnv])
SCENARIO = small_flock(num_agents=4)


def trained(make: type[VecEnv], seed: int = 0, action_mode: str = "normalized") -> PPO:
    env = make(2, SCENARIO, action_mode=action_mode)
    model = PPO("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=2, seed=seed, device="cpu")
    return model.learn(32 * env.num_envs * 2)


def weights(model: PPO) -> dict[str, torch.Tensor]:
    return model.policy.state_dict()


@ENVS
def test_training_twice_gives_the_same_weights(make: type[VecEnv]) -> None:
    first, second, other = trained(make), trained(make), trained(make, seed=1)
    for name, weight in weights(first).items():
        assert torch.isfinite(weight).all()
        assert torch.equal(weight, weights(second)[name])
    assert any(not torch.equal(weight, weights(other)[name]) for name, weight in weights(first).items())


@ENVS
def test_training_changes_the_policy(make: type[VecEnv]) -> None:
    model = trained(make)
    untrained = PPO("MlpPolicy", make(2, SCENARIO), n_steps=32, batch_size=32, seed=0, device="cpu")
    assert any(not torch.equal(w, weights(untrained)[name]) for name, w in weights(model).items())


@ENVS
def test_discrete_actions_train(make: type[VecEnv]) -> None:
    assert trained(make, action_mode="discrete").num_timesteps > 0


@ENVS
def test_trained_model_is_a_policy(make: type[VecEnv]) -> None:
    policy = SB3Policy(trained(make))
    env = make(2, SCENARIO)
    env.seed(0)
    act, observations, total = bind(policy, env), env.reset(), np.zeros(env.num_envs)
    for _ in range(SCENARIO.num_steps):
        observations, rewards, _, _ = env.step(act(observations))
        total += rewards
    episodes = rollout(SCENARIO, policy, [0, 1], per_agent=make is AgentVecEnv)
    np.testing.assert_allclose(episodes.mean_return, total.reshape(2, -1).mean(axis=1), atol=1e-4)
