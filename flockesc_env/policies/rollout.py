"""Whole episodes under a policy, one per seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_callback, as_count, as_policy, as_seed, as_seeds
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import EnvOptionsDict, env_options
from flockesc_env.episodes.predators import PredatorPolicy, PredatorPolicySpec
from flockesc_env.models.simulate import IntArray, Trajectory, simulate
from flockesc_env.policies.ranges import Observations, Policy
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario


@dataclass(frozen=True, eq=False)
class Episodes:
    """Outcomes of one policy, one entry per seed.

    Attributes:
        seeds: shape (seeds,).
        min_mean_distance: J_mean in m (Eq. 12), shape (seeds,).
        min_min_distance: J_min in m (Eq. 13), shape (seeds,).
        fraction_surviving: share of the agents that were not caught by the end, shape (seeds,).
        num_components: connected components at the end, shape (seeds,).
        mean_return: sum of the rewards, averaged over agents, shape (seeds,); who was caught is paid no more.
    """

    seeds: NDArray[np.uint64]
    min_mean_distance: FloatArray
    min_min_distance: FloatArray
    fraction_surviving: FloatArray
    num_components: IntArray
    mean_return: FloatArray


def rollout(
    policy: Policy,
    seeds: Iterable[int],
    *,
    scenario: FlockScenario | str | None = None,
    per_agent: bool = False,
    batch_size: int = 64,
    num_threads: int | None = None,
    predator_policy: PredatorPolicy | None = None,
    progress: Callable[[int, int], None] | None = None,
    **options: Unpack[EnvOptionsDict],
) -> Episodes:
    """Run a policy on the flock of every seed, to the horizon.

    Args:
        policy: sets the ranges.
        seeds: seed k is the flock of ``env.reset(seed=k)``.
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        per_agent: whether the policy sets one range per agent, or one per flock.
        batch_size: flocks stepped together; only a policy that draws at random can tell the difference.
        num_threads: threads over which flocks are spread; ``None``: one per core.
        progress: called with (finished episodes, all episodes).
        predator_policy: controls the ``Learned`` predators, for example ``Pursue()`` or a trained
            ``SB3Policy``. ``None``: they fly straight on.
        **options: see ``EnvOptions``.

    Raises:
        ArgumentError: naming the argument of a wrong type or value.
        OptionError: for an option that is unknown, missing or out of bounds.
    """
    as_policy(policy)
    checked = as_seeds(seeds)
    scenario = as_scenario(scenario, FlockScenario)
    chosen = env_options(scenario, options)
    batch_size, progress = as_count(batch_size, "batch_size"), as_callback(progress)
    parts: list[dict[str, NDArray[Any]]] = []
    finished = 0
    for start in range(0, len(checked), batch_size):
        chunk = checked[start : start + batch_size]
        batch = FlockBatch(
            scenario,
            chosen,
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
            progress(finished, len(checked))
    names = ("min_mean_distance", "min_min_distance", "fraction_surviving", "num_components", "mean_return")
    columns = {name: np.concatenate([part[name] for part in parts]) for name in names}
    return Episodes(seeds=np.array(checked, np.uint64), **columns)


def record(
    policy: Policy,
    seed: int,
    *,
    scenario: FlockScenario | str | None = None,
    per_agent: bool = False,
    predator_policy: PredatorPolicy | None = None,
    **options: Unpack[EnvOptionsDict],
) -> Trajectory:
    """Run a policy on one flock and record all of it, as ``simulate`` does under the ranges it chose.

    Args:
        policy: sets the ranges.
        seed: seed of the flock.
        scenario: the flock model's parameters, or a preset's name; default: the paper's.
        per_agent: whether the policy sets one range per agent, or one for the flock.
        predator_policy: controls the ``Learned`` predators, for example ``Pursue()`` or a trained
            ``SB3Policy``. ``None``: they fly straight on.
        **options: see ``EnvOptions``.

    Raises:
        ArgumentError: naming the argument of a wrong type or value.
        OptionError: for an option that is unknown, missing or out of bounds.
    """
    as_policy(policy)
    seed = as_seed(seed)
    scenario = as_scenario(scenario, FlockScenario)
    chosen = env_options(scenario, options)
    hunter = None if predator_policy is None else _Noting(as_policy(predator_policy, "predator_policy"))
    batch = FlockBatch(scenario, chosen, per_agent=per_agent, predator_policy=hunter)
    ranges = np.array([ranges for ranges, _ in episode_steps(batch, policy, [seed])])

    def schedule(actions: FloatArray) -> FloatArray:
        held = np.repeat(actions, chosen.steps_per_action, axis=0)[: scenario.num_steps]
        rest = scenario.num_steps - len(held)  # nobody is left to listen or to be hunted
        return np.concatenate([held, np.repeat(held[-1:], rest, axis=0)])

    predator_actions = None if hunter is None else schedule(np.array(hunter.actions))
    return simulate(batch.scenario, schedule(ranges), seed=seed, predator_actions=predator_actions)


class _Noting:
    """A predator policy that keeps the actions of another one."""

    def __init__(self, policy: PredatorPolicy) -> None:
        self.policy = policy
        self.actions: list[FloatArray] = []

    def act(self, observations: Observations, spec: PredatorPolicySpec) -> FloatArray:
        actions = self.policy.act(observations, spec)
        self.actions.append(spec.plain(actions, len(observations)))
        return self.actions[-1]


def episode_steps(
    batch: FlockBatch, policy: Policy, seeds: Sequence[int]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Step the flocks of ``seeds``, one per slot, under a policy to the horizon, or until nobody is left.

    Yields:
        After every action: ranges in m and rewards, both of shape (num_flocks * rows,).
    """
    observations, _ = batch.reset(range(batch.num_flocks), seeds)
    has_ended = False
    while not has_ended:
        actions = policy.act(observations, batch.policy_spec)
        observations, rewards, ended, ranges, _ = batch.step(actions, at_end="stay")
        has_ended = bool(ended.all())
        yield ranges, rewards
