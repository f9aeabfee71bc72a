"""What ranges cost: ``mean_range``, ``mean_heard`` and the option ``range_cost``."""

from typing import Any

import numpy as np
import pytest
import reference
from option_table import AGENT_REWARDS, INDIVIDUAL_REWARDS, doomed, hunted, small_flock

import flockesc_env as fe

FLOCKS = {"small": small_flock(), "hunted": hunted(3), "caught": doomed()}


@pytest.mark.parametrize("policy", ["fixed:12.5", "stubborn-leaders"])
@pytest.mark.parametrize("flock", ["small", "hunted", "caught"])
def test_the_load_of_a_flock(flock: str, policy: str) -> None:
    scenario, seed = FLOCKS[flock], 3
    run = fe.simulate(scenario, policy=policy, seed=seed)
    assert (run.caught_at >= 0).any() == (flock != "small")
    mean_range, mean_heard = reference.load_of(run)
    played = fe.rollout(scenario, policy, [5, seed])
    assert played.mean_heard[1] == mean_heard > 0
    np.testing.assert_allclose(played.mean_range[1], mean_range, rtol=1e-14)
    if policy == "fixed:12.5":
        assert played.mean_range.tolist() == [12.5, 12.5]
        each = fe.rollout(scenario, policy, [5, seed], per_agent=True)
        np.testing.assert_array_equal(each.mean_heard, played.mean_heard)
        np.testing.assert_array_equal(each.mean_range, played.mean_range)


@pytest.mark.parametrize("reward", AGENT_REWARDS)
def test_range_cost_lowers_the_reward_of_every_action_as_a_wrapper_would(reward: Any) -> None:
    options: Any = {"reward": reward, "action_mode": "range", "steps_per_action": 3}
    plain, costly = (fe.parallel_env(hunted(), range_cost=cost, **options) for cost in (0.0, 0.01))
    for env in (plain, costly):
        env.reset_array(seed=3)
    rng, alive = np.random.default_rng(0), np.ones(9, bool)
    while plain.agents:
        ranges = rng.uniform(0, 20, (9, 1))
        (_, expected, ended, *_), (_, rewards, *_) = (env.step_array(ranges) for env in (plain, costly))
        paid = ranges[:, 0] if reward in INDIVIDUAL_REWARDS else ranges[alive].mean()
        assert (rewards[~alive] == 0).all()
        np.testing.assert_allclose(rewards[alive], (expected - 0.01 * paid)[alive], rtol=0, atol=1e-14)
        if reward in INDIVIDUAL_REWARDS:
            np.testing.assert_array_equal(rewards[alive], (expected - 0.01 * paid)[alive])
        alive = ~ended
    assert not alive.all()


def test_a_restored_episode_continues_its_load() -> None:
    env = fe.FlockEscapeEnv(action_mode="range", steps_per_action=2)
    env.reset(seed=3)
    env.step(np.array([0.5]))
    env.set_state(env.get_state())
    env.step(np.array([0.25]))
    assert env._batch.core.metrics()["mean_range"] == 0.375
