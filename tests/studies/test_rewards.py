"""Gains of half of the agents over the others: exact invariants, and single episodes step by step."""

import numpy as np
import pytest

from flockesc_env import parallel_env
from flockesc_env.tasks import tasks
from studies.scoreboard.rewards import gains, pairs_of


def test_equal_ranges_gain_nothing_and_the_order_is_the_sign() -> None:
    same = gains("per-agent-local", 12.0, 12.0, range(2))
    np.testing.assert_allclose(same["team"], 0)
    np.testing.assert_allclose(same["own"], 0, atol=1e-9)  # each agent is once in each half
    there, back = (gains("per-agent-local", *pair, range(2)) for pair in ((12.0, 0.0), (0.0, 12.0)))
    np.testing.assert_array_equal(there["team"], -back["team"])
    np.testing.assert_allclose(there["own"], -back["own"], rtol=1e-9)


def test_gains_equal_episodes_of_the_environment() -> None:
    """In PettingZoo's environment, with the roles that the flock's seed draws."""
    task, seed, means = tasks["pursuit"], 3, []
    env = parallel_env(task.scenario, **{**task.options, "reward": "individual", "action_mode": "range"})
    first = np.random.default_rng(seed).permutation(300) < 150
    for holds in (first, ~first):
        env.reset(seed=seed)
        returns = np.zeros(300)
        while env.agents:
            actions = {name: [8.0 if held else 20.0] for name, held in zip(env.agents, holds, strict=True)}
            _, rewards, *_ = env.step(actions)
            returns += np.array(list(rewards.values()))
        means.append(returns[holds].mean() - returns[~holds].mean())
    assert gains("pursuit", 8.0, 20.0, range(seed, seed + 1))["own"] == pytest.approx(np.mean(means))


def test_pairs_lie_within_the_ranges_of_an_action() -> None:
    assert pairs_of(tasks["per-agent-visible-minimum"]) == [(20.0, 0.0), (20.0, 10.0)]
    assert pairs_of(tasks["one-range"]) == pairs_of(tasks["held-out-sizes"]) == []
