"""SuperSuit wraps the PettingZoo environment; training uses the package's own adapters."""

from __future__ import annotations

import numpy as np
import supersuit

from flockesc_env import FlockScenario, parallel_env

SCENARIO = FlockScenario(num_agents=4, num_steps=40)


def test_wrapped_episodes_equal_those_of_the_environment() -> None:
    plain = parallel_env(SCENARIO)
    env = supersuit.dtype_v0(supersuit.black_death_v3(parallel_env(SCENARIO)), np.float64)
    for each in (env, plain):
        each.reset(seed=3)
    while plain.agents:
        actions = {agent: plain.action_space(agent).sample() for agent in plain.agents}
        observations, rewards = env.step(actions)[:2]
        expected, paid = plain.step(actions)[:2]
        assert rewards == paid
        for agent, seen in observations.items():
            assert seen.dtype == np.float64
            np.testing.assert_array_equal(seen, expected[agent])


def test_frames_are_stacked_and_vectorized() -> None:
    stacked = supersuit.frame_stack_v1(parallel_env(SCENARIO), 3)
    entries = parallel_env(SCENARIO).observation_space("agent_0").shape[0]
    assert stacked.observation_space("agent_0").shape == (3 * entries,)
    envs = supersuit.pettingzoo_env_to_vec_env_v1(parallel_env(SCENARIO))
    observations, _ = envs.reset(seed=3)
    assert len(observations) == SCENARIO.num_agents
