"""Rollouts of a policy object on flocks: outcomes of many episodes, or one recorded run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_policy
from flockesc_env.common.notebook import Displayed
from flockesc_env.episodes.batch import Columns, FlockBatch
from flockesc_env.episodes.memory import reset_policy
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.episodes.options import EnvOptions
from flockesc_env.episodes.predators import PredatorPolicy, PredatorPolicySpec
from flockesc_env.models.simulate import IntArray, Trajectory, simulate
from flockesc_env.policies.base import Observations, Policy
from flockesc_env.policies.network import NetworkPolicy
from flockesc_env.policies.network_rollout import play_flocks_of_networks
from flockesc_env.scenario.flock import FlockScenario


@dataclass(frozen=True, eq=False, repr=False)
class Episodes(Displayed):
    """Results of ``rollout`` on flocks, one entry per seed.

    Attributes:
        seeds: the seeds, shape (seeds,).
        min_mean_distance: J_mean in m (Eq. 12), shape (seeds,).
        min_min_distance: J_min in m (Eq. 13), shape (seeds,).
        fraction_surviving: share of agents that are not caught at the end, shape (seeds,).
        num_components: number of connected components at the end, shape (seeds,).
        mean_return: undiscounted return, averaged over agents, shape (seeds,). The reward of a caught agent
            is 0.
    """

    seeds: NDArray[np.uint64]
    min_mean_distance: FloatArray
    min_min_distance: FloatArray
    fraction_surviving: FloatArray
    num_components: IntArray
    mean_return: FloatArray

    def _summary(self) -> dict[str, object]:
        names = (spec.column for spec in FLOCK_OBJECTIVES.values())
        return {"num_seeds": len(self.seeds), **{name: float(getattr(self, name).mean()) for name in names}}


def play_flocks(
    policy: Policy,
    seeds: list[int],
    scenario: FlockScenario,
    options: EnvOptions,
    *,
    per_agent: bool,
    batch_size: int,
    num_threads: int | None,
    predator_policy: PredatorPolicy | None,
    progress: Callable[[int, int], None] | None,
) -> Episodes:
    """Run a policy on the flock of every seed; see ``rollout``."""
    if type(policy) is NetworkPolicy and predator_policy is None:
        columns = play_flocks_of_networks(
            policy.architecture,
            policy.parameters[np.newaxis],
            seeds,
            scenario,
            options,
            per_agent=per_agent,
            num_threads=num_threads,
            progress=progress,
        )
        return _episodes(seeds, [columns])
    parts: list[Columns] = []
    finished = 0
    for start in range(0, len(seeds), batch_size):
        chunk = seeds[start : start + batch_size]
        batch = FlockBatch(
            scenario,
            options,
            num_flocks=len(chunk),
            per_agent=per_agent,
            num_threads=num_threads,
            predator_policy=predator_policy,
        )
        total = np.zeros(len(chunk))
        for _, rewards in episode_steps(batch, policy, chunk):
            total += rewards.reshape(len(chunk), -1).mean(axis=1)
        components = batch.num_components()
        parts.append({**batch.metrics(), "num_components": components, "mean_return": total})
        finished += len(chunk)
        if progress is not None:
            progress(finished, len(seeds))
    return _episodes(seeds, parts)


def _episodes(seeds: list[int], parts: list[Columns]) -> Episodes:
    names = (*(spec.column for spec in FLOCK_OBJECTIVES.values()), "num_components", "mean_return")
    columns = {name: np.concatenate([part[name] for part in parts]) for name in names}
    return Episodes(seeds=np.array(seeds, np.uint64), **columns)


def record_flock(
    policy: Policy,
    seed: int,
    scenario: FlockScenario,
    options: EnvOptions,
    *,
    per_agent: bool,
    predator_policy: PredatorPolicy | None = None,
) -> Trajectory:
    """Run a policy on one flock and return the trajectory; see ``record``."""
    _core.check_record(scenario.to_json(), scenario.num_agents if per_agent else 1)
    recorder = None if predator_policy is None else _Recorder(as_policy(predator_policy, "predator_policy"))
    batch = FlockBatch(scenario, options, per_agent=per_agent, predator_policy=recorder)
    ranges = np.array([ranges for ranges, _ in episode_steps(batch, policy, [seed])])

    def per_step(actions: FloatArray) -> FloatArray:
        held = np.repeat(actions, options.steps_per_action, axis=0)[: scenario.num_steps]
        rest = scenario.num_steps - len(held)  # after the last agent was caught
        return np.concatenate([held, np.repeat(held[-1:], rest, axis=0)])

    predator_actions = None if recorder is None else per_step(np.array(recorder.actions))
    schedule = per_step(ranges)
    return simulate(batch.scenario, schedule=schedule, seed=seed, predator_actions=predator_actions)


class _Recorder:
    """Wraps a predator policy and records its actions."""

    def __init__(self, policy: PredatorPolicy) -> None:
        self.policy = policy
        self.actions: list[FloatArray] = []

    def reset(self, rows: NDArray[np.bool]) -> None:
        reset_policy(self.policy, rows)

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> FloatArray:
        actions = self.policy.act(observations, spec)
        self.actions.append(spec.plain(actions, len(observations)))
        return self.actions[-1]


def episode_steps(
    batch: FlockBatch, policy: Policy, seeds: Sequence[int]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Run a policy in every slot of a batch until all episodes have ended.

    Args:
        batch: the batch.
        policy: sets the ranges.
        seeds: one seed per slot.

    Yields:
        Ranges in m and rewards after every action, both of shape (num_flocks * rows,).
    """
    observations, _ = batch.reset(range(batch.num_flocks), seeds)
    reset_policy(policy, np.ones(len(observations), bool))
    has_ended = False
    while not has_ended:
        actions = policy.act(observations, batch.policy_spec)
        observations, rewards, ended, ranges, _ = batch.step(actions, at_end="stay")
        has_ended = bool(ended.all())
        yield ranges, rewards
