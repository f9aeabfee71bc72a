"""Whole episodes of the line under a policy, one per seed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_count, as_policy, as_seeds
from flockesc_env.episodes.options import LineOptions, LineOptionsDict, line_options
from flockesc_env.episodes.spaces import ObservationLayout, PolicySpec, RangeActions
from flockesc_env.models.simulate import IntArray
from flockesc_env.policies.ranges import Policy
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_scenario


@dataclass(frozen=True, eq=False)
class LineEpisodes:
    """Outcomes of one policy, one entry per seed.

    Attributes:
        seeds: shape (seeds,).
        escape_distance: d at the end of the episode, shape (seeds,): d_ss where it stood still.
        num_components: at the end, shape (seeds,).
        steps: steps of the model, shape (seeds,).
        converged: whether the line stood still, shape (seeds,).
    """

    seeds: NDArray[np.uint64]
    escape_distance: FloatArray
    num_components: IntArray
    steps: IntArray
    converged: NDArray[np.bool]


def rollout_line(
    policy: Policy,
    seeds: Iterable[int],
    *,
    scenario: LineScenario | str | None = None,
    batch_size: int = 256,
    **options: Unpack[LineOptionsDict],
) -> LineEpisodes:
    """Run a policy on the line of every seed, until it stands still or the scenario's last step.

    Args:
        policy: sets the range.
        seeds: seed k is the line of ``env.reset(seed=k)``.
        scenario: the line model's parameters, or a preset's name; default: the paper's.
        batch_size: lines for which the policy is asked at once; those that have ended keep their row.
        **options: see ``LineOptions``.

    Raises:
        ArgumentError: naming the argument of a wrong type or value.
        OptionError: for an option that is unknown or out of bounds.
        ScenarioError: for a scenario without predator.
    """
    as_policy(policy)
    checked = as_seeds(seeds)
    line = as_scenario(scenario, LineScenario)
    chosen = line_options(options)
    size = as_count(batch_size, "batch_size")
    spec = line_policy_spec(line, chosen)
    ended: list[_core.LineEpisode] = []
    for start in range(0, len(checked), size):
        ended += _play(policy, checked[start : start + size], line, chosen, spec)
    return LineEpisodes(
        seeds=np.array(checked, np.uint64),
        escape_distance=np.array([episode.escape_distance for episode in ended]),
        num_components=np.array([episode.num_components for episode in ended], np.int64),
        steps=np.array([episode.steps for episode in ended], np.int64),
        converged=np.array([episode.is_steady for episode in ended]),
    )


def line_policy_spec(scenario: LineScenario, options: LineOptions) -> PolicySpec:
    """Return what a policy needs to know to steer a line."""
    return PolicySpec(
        actions=RangeActions(options),
        layout=ObservationLayout.of(_core.line_observation_entries(scenario.num_agents)),
        per_agent=False,
        num_agents=scenario.num_agents,
        num_steps=scenario.max_steps,
    )


def _play(
    policy: Policy, seeds: list[int], scenario: LineScenario, options: LineOptions, spec: PolicySpec
) -> list[_core.LineEpisode]:
    documents = scenario.to_json(), options.to_core()
    episodes = [_core.LineEpisode(*documents, seed) for seed in seeds]
    observations = np.stack([episode.observe() for episode in episodes])
    running = list(range(len(episodes)))
    while running:
        actions = policy.act(observations, spec)
        ranges = spec.actions.to_ranges(actions, len(episodes))
        for row in running:
            episodes[row].step(float(ranges[row]))
            observations[row] = episodes[row].observe()
        running = [row for row in running if not episodes[row].has_ended]
    return episodes
