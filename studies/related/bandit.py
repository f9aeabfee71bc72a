"""``RangeBandit``: a sliding-window UCB1 bandit over fixed ranges, as a policy within an episode.

UCB1 is from Auer, Cesa-Bianchi and Fischer, "Finite-time analysis of the multiarmed bandit problem" (2002);
the window is from Garivier and Moulines, "On upper-confidence bound policies for switching bandit problems"
(2011). Liao, Wu and Wu, "Dynamic sight range selection in multi-agent reinforcement learning" (AAMAS 2025),
choose the sight range of training episodes with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env import PolicySpec
from flockesc_env.common.stats import FloatArray
from flockesc_env.policies.base import Observations, RowMemory

Arms = NDArray[np.int64]


class RangeBandit(RowMemory):
    """A policy that treats every range as an arm of a bandit and every action as a pull.

    The reward of a pull is the change of one observation entry until the next action. A pull takes the arm
    with the largest of the ``ucb_scores``, the first one in a tie. An episode therefore begins with every arm
    once, in order.
    """

    def __init__(
        self,
        ranges: Sequence[float],
        exploration: float,
        window: int | None = None,
        entry: str = "mean_distance",
    ) -> None:
        self.ranges = np.array(ranges, np.float64)
        self.exploration = exploration
        self.window = window
        self.entry = entry

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Return the action of the pulled arm for every row; see ``Policy.act``."""
        values = observations[:, spec.layout.index(self.entry)].astype(np.float64)
        begins = self._begin(len(values))
        arms: Arms = np.zeros((len(values), 0), np.int64)
        rewards: FloatArray = np.zeros((len(values), 0))
        if not begins.all():
            arms, rewards, before = self._recall(begins, -1, 0.0, 0.0)  # -1: no arm
            rewards[:, -1] = values - before
        scores = ucb_scores(arms, rewards, len(self.ranges), self.exploration)
        pulled = scores.argmax(axis=1)
        kept = slice(-self.window if self.window else None, None)
        arms = np.column_stack([arms, pulled])[:, kept]
        rewards = np.column_stack([rewards, np.zeros(len(values))])[:, kept]
        self._remember(len(values), arms, rewards, values)
        return spec.actions.from_ranges(self.ranges[pulled])


def ucb_scores(arms: Arms, rewards: FloatArray, num_arms: int, exploration: float) -> FloatArray:
    """Return the score of every arm: its mean reward plus c sqrt(2 ln t / t_k); infinite without a pull.

    t is the number of pulls and t_k that of arm k.

    Returns:
        Scores, shape (rows, num_arms).
    """
    is_pulled = arms[:, :, None] == np.arange(num_arms)
    counts = is_pulled.sum(axis=1)
    sums = np.where(is_pulled, rewards[:, :, None], 0.0).sum(axis=1)
    pulls = np.maximum(counts.sum(axis=1, keepdims=True), 1)
    least = np.maximum(counts, 1)
    scores = sums / least + exploration * np.sqrt(2 * np.log(pulls) / least)
    return np.where(counts > 0, scores, np.inf)


def across_episodes(values: FloatArray, exploration: float) -> Arms:
    """Return the arm that UCB1 pulls in every episode, shape (episodes,)."""
    num_arms, episodes = values.shape
    arms, rewards = np.full((1, episodes), -1), np.zeros((1, episodes))
    for episode in range(episodes):
        known = slice(0, episode)
        scores = ucb_scores(arms[:, known], rewards[:, known], num_arms, exploration)
        arms[0, episode] = scores[0].argmax()
        rewards[0, episode] = values[arms[0, episode], episode]
    pulled: Arms = arms[0]
    return pulled
