"""Rollouts of a policy object on lines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray
from flockesc_env.common.notebook import Displayed
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.options import LineOptions
from flockesc_env.episodes.spaces import PolicySpec, line_policy_spec
from flockesc_env.models.simulate import IntArray
from flockesc_env.policies.base import Policy
from flockesc_env.policies.network import NetworkPolicy
from flockesc_env.policies.network_rollout import play_lines_of_networks
from flockesc_env.scenario.line import LineScenario


@dataclass(frozen=True, eq=False, repr=False)
class LineEpisodes(Displayed):
    """Results of ``rollout`` on lines, one entry per seed.

    Attributes:
        seeds: the seeds, shape (seeds,).
        escape_distance: escape distance at the end of the episode, shape (seeds,); d_ss if ``converged``.
        num_components: number of connected components at the end, shape (seeds,).
        steps: number of model steps, shape (seeds,).
        converged: whether the line reached its steady state, shape (seeds,).
    """

    seeds: NDArray[np.uint64]
    escape_distance: FloatArray
    num_components: IntArray
    steps: IntArray
    converged: NDArray[np.bool]

    def _summary(self) -> dict[str, object]:
        return {"num_seeds": len(self.seeds), "escape_distance": float(self.escape_distance.mean())}


def play_lines(
    policy: Policy,
    seeds: list[int],
    scenario: LineScenario,
    options: LineOptions,
    *,
    batch_size: int,
    num_threads: int | None,
    progress: Callable[[int, int], None] | None = None,
) -> LineEpisodes:
    """Run a policy on the line of every seed; see ``rollout``."""
    if type(policy) is NetworkPolicy:
        columns = play_lines_of_networks(
            policy.architecture,
            policy.parameters[np.newaxis],
            seeds,
            scenario,
            options,
            num_threads=num_threads,
            progress=progress,
        )
        del columns["num_actions"]
        return LineEpisodes(seeds=np.array(seeds, np.uint64), **columns)
    spec = line_policy_spec(scenario, options)
    ended: list[_core.LineEpisode] = []
    for start in range(0, len(seeds), batch_size):
        ended += _play(policy, seeds[start : start + batch_size], scenario, options, spec)
        if progress is not None:
            progress(len(ended), len(seeds))
    return LineEpisodes(
        seeds=np.array(seeds, np.uint64),
        escape_distance=np.array([episode.escape_distance for episode in ended]),
        num_components=np.array([episode.num_components for episode in ended], np.int64),
        steps=np.array([episode.steps for episode in ended], np.int64),
        converged=np.array([episode.is_steady for episode in ended]),
    )


def _play(
    policy: Policy, seeds: list[int], scenario: LineScenario, options: LineOptions, spec: PolicySpec
) -> list[_core.LineEpisode]:
    _core.check_lines("batch_size", scenario.num_agents, len(seeds))
    documents = scenario.to_json(), options.to_core()
    episodes = [_core.LineEpisode(*documents, seed) for seed in seeds]
    observations = np.stack([episode.observe() for episode in episodes])
    reset_policy(policy, np.ones(len(episodes), bool))
    running = list(range(len(episodes)))
    while running:
        actions = policy.act(observations, spec)
        ranges = spec.actions.to_ranges(actions, len(episodes))
        for row in running:
            episodes[row].step(float(ranges[row]))
            observations[row] = episodes[row].observe()
        running = [row for row in running if not episodes[row].has_ended]
    return episodes
