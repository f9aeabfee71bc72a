"""The bandit over fixed ranges: scores and choices of small cases computed by hand, and rollouts."""

from __future__ import annotations

from math import inf, log, sqrt

import numpy as np
from option_table import small_flock

from flockesc_env import FlockEscapeEnv
from studies.related.bandit import RangeBandit, across_episodes, ucb_scores
from studies.related.within_episode import control, orders

SCENARIO = small_flock(num_agents=6, num_steps=24)
RANGES = (0.0, 10.0, 40.0)
"""Ranges of the arms in m."""


def test_scores_of_a_small_case() -> None:
    # Five pulls: arm 0 twice with rewards 1 and 3, arm 2 three times with rewards 0, 0 and 6.
    arms, rewards = np.array([[0, 2, 2, 0, 2]]), np.array([[1.0, 0.0, 0.0, 3.0, 6.0]])
    expected = [2 + 0.5 * sqrt(2 * log(5) / 2), inf, 2 + 0.5 * sqrt(2 * log(5) / 3)]
    np.testing.assert_allclose(ucb_scores(arms, rewards, 3, 0.5), [expected], rtol=1e-15)


def test_ucb1_across_episodes_pulls_what_a_hand_computed_run_pulls() -> None:
    # Rewards 0.9 and 0.5, c = 1. Both arms once. Then 0.9 + sqrt(2 ln 2) > 0.5 + sqrt(2 ln 2): arm 0.
    # t = 3: 0.9 + sqrt(2 ln 3 / 2) = 1.948 < 0.5 + sqrt(2 ln 3) = 1.982: arm 1.
    # t = 4: 0.9 + sqrt(2 ln 4 / 2) = 2.077 > 0.5 + sqrt(2 ln 4 / 2) = 1.677: arm 0.
    # t = 5: 0.9 + sqrt(2 ln 5 / 3) = 1.936 > 0.5 + sqrt(2 ln 5 / 2) = 1.769: arm 0.
    # t = 6: 0.9 + sqrt(2 ln 6 / 4) = 1.847 > 0.5 + sqrt(2 ln 6 / 2) = 1.839: arm 0.
    # t = 7: 0.9 + sqrt(2 ln 7 / 5) = 1.782 < 0.5 + sqrt(2 ln 7 / 2) = 1.895: arm 1.
    values = np.repeat([[0.9], [0.5]], 8, axis=1)
    assert across_episodes(values, 1.0).tolist() == [0, 1, 0, 1, 0, 0, 0, 1]


def observed_run(bandit: RangeBandit, values: list[list[float]], entry: str) -> list[list[float]]:
    """Return the ranges that a bandit sets for given values of its observation entry, per action and row."""
    spec = FlockEscapeEnv(SCENARIO, max_range=40.0).policy_spec
    ranges = []
    for row in values:
        observations = np.zeros((len(row), len(spec.layout.names)), np.float32)
        observations[:, spec.layout.index(entry)] = row
        actions = bandit.act(observations, spec)
        ranges.append(spec.actions.to_ranges(actions, len(row)).round(6).tolist())
    return ranges


def test_a_window_forgets_old_pulls() -> None:
    # Arm 1 has the largest reward. With a window of 3, arm 0's pull has left it at the fifth action: arm 0
    # is pulled again, as if it were new.
    values = [[0.0], [0.1], [0.6], [0.7], [0.9], [1.0]]
    kept = observed_run(RangeBandit(RANGES, 0.0), values, "mean_distance")
    assert np.ravel(kept).tolist() == [0, 10, 40, 10, 10, 10]
    windowed = observed_run(RangeBandit(RANGES, 0.0, window=3), values, "mean_distance")
    assert np.ravel(windowed).tolist() == [0, 10, 40, 10, 0, 10]


def test_a_reset_row_begins_again_and_leaves_the_others() -> None:
    bandit = RangeBandit(RANGES, 0.0)
    bandit.reset(np.array([True, True]))
    before = observed_run(bandit, [[0.0, 0.0], [0.1, 0.1], [0.6, 0.6]], "mean_distance")
    assert before == [[0, 0], [10, 10], [40, 40]]
    bandit.reset(np.array([False, True]))
    after = observed_run(bandit, [[0.7, 0.7], [0.9, 0.9]], "mean_distance")
    assert after == [[10, 0], [10, 10]]


def test_the_control_tries_every_order_of_three_arms_and_every_start_of_more() -> None:
    tried = orders(RANGES)
    assert tried[0] == RANGES
    assert len(set(tried)) == len(tried) == 6
    assert {tuple(sorted(order)) for order in tried} == {RANGES}
    many = orders((0.0, 5.0, 10.0, 15.0, 20.0))
    assert [order[0] for order in many] == [0, 5, 10, 15, 20, 20, 15, 10, 5, 0]
    assert len(set(many)) == 10


def test_the_control_is_paired() -> None:
    flocks = 10.0 * np.arange(8)  # differ by far more than the arms do
    found = control((8.0, 12.0), bandit=flocks + 3, turns=flocks + 1, fixed=flocks)
    differences = (found.turns, found.bandit, found.over_turns)
    assert [(each.low, each.mean, each.high) for each in differences] == [(1,) * 3, (3,) * 3, (2,) * 3]
