"""Results do not depend on threads or batch size, bit for bit. Places: test_vector_env.py."""

import math
from typing import Any

import numpy as np
import pytest
from option_table import DIMENSIONS, EVERY_STEP, small_flock
from same import same

import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.policies import FixedRange, StubbornLeaders
from flockesc_env.scenario import Inertial, Reynolds

SEEDS = range(13)
THREADS = [None, 1, 2, 3, 7]
dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)


@dimensions
def test_flock_sweep(dimension: int) -> None:
    scenario, ranges = small_flock(dimension, num_agents=40), [0.0, 4.0, 9.0]
    first, *others = (fe.sweep(scenario, ranges, SEEDS, num_threads=n) for n in THREADS)
    for result in others:
        same(result, first)
    for row, rho in enumerate(ranges):
        for column in (0, 12):
            alone = fe.sweep(scenario, [rho], [SEEDS[column]])
            for name in ("min_mean_distance", "min_min_distance", "num_components"):
                assert getattr(alone, name) == getattr(first, name)[row, column]


@dimensions
@pytest.mark.parametrize("per_agent", [False, True])
def test_rollout(dimension: int, per_agent: bool) -> None:
    scenario = small_flock(dimension, num_agents=40)
    policy = StubbornLeaders() if per_agent else FixedRange(9.0)
    options = {**EVERY_STEP, "per_agent": per_agent, "predator_sensing_range": math.inf}
    first, *others = (
        fe.rollout(scenario, policy, SEEDS, batch_size=size, num_threads=count, **options)
        for size, count in [(64, None), (1, 1), (1, 2), (5, 1), (5, 3), (13, 2)]
    )
    for result in others:
        same(result, first)


def simulated(scenario: fe.FlockScenario, num_threads: int | None) -> list[Any]:
    """Simulate equal agents, and different, noisy ones under two laws of motion."""
    names, rng = ("mass", "speed", "repulsion_strength", "alignment_strength"), np.random.default_rng(0)
    traits: dict[str, Any] = {name: rng.uniform(0.5, 2, 5000) * getattr(scenario, name) for name in names}
    noisy = scenario.replace(angular_noise=0.5, sensing_noise=0.5, sensing_delay=2, **traits)
    scenarios = (scenario, noisy.replace(motion=Inertial()), noisy.replace(motion=Reynolds()))
    return [
        fe.simulate(each, rho, seed=2, num_threads=num_threads)
        for each in scenarios
        for rho in (6.0, np.linspace(0.0, 20.0, 5000))
    ]


def agents_played(scenario: fe.FlockScenario, num_threads: int | None) -> list[Any]:
    env = fe.parallel_env(scenario, num_threads=num_threads, reward="individual_distance", **EVERY_STEP)
    rng = np.random.default_rng(0)
    steps: list[Any] = [env.reset_array(seed=2)]
    return steps + [env.step_array(rng.uniform(-1, 1, (5000, 1)).astype(np.float32)) for _ in range(8)]


def flocks_played(scenario: fe.FlockScenario, num_threads: int | None) -> list[Any]:
    """Play two large flocks into their second episode; batch and flocks share the threads."""
    env = BatchVectorEnv(2, scenario, num_threads=num_threads, **EVERY_STEP)
    env.action_space.seed(0)
    return [env.reset(seed=2), *(env.step(env.action_space.sample()) for _ in range(11))]


@dimensions
@pytest.mark.parametrize("played", [simulated, agents_played, flocks_played])
def test_threads_of_one_large_flock(played: Any, dimension: int) -> None:
    """The flock is large enough to be split over threads, with 0.03 agents per m^D."""
    side = (5000 / 0.03) ** (1 / dimension)
    scenario = fe.FlockScenario(num_agents=5000, num_steps=8, dimension=dimension, initial_side=side)
    serial = played(scenario, 1)
    for threads in (2, 7):
        same(played(scenario, threads), serial)
