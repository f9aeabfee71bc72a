"""Child processes: threads that a parent has used do not keep its children from using their own."""

from __future__ import annotations

import functools
import multiprocessing
from multiprocessing.queues import SimpleQueue

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv
from option_table import small_flock

from flockesc_env import FlockEscapeEnv, FlockScenario, FlockVectorEnv, LineScenario, rollout, sweep
from flockesc_env.policies import FixedRange

TIMEOUT = 120.0  # only a child that hangs needs as long
METHODS = pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])

# Python warns of what this test is about.
pytestmark = pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")


@METHODS
def test_child_sweeps_after_its_parent_has(method: str) -> None:
    flocks, lines, seeds = small_flock(num_agents=30), LineScenario(), range(8)
    here = sweep(flocks, [0.0, 9.0], seeds, num_threads=2)
    here_line = sweep(lines, [0.1], seeds)
    here_rollout = rollout(FixedRange(25.0), seeds, scenario=flocks, num_threads=2)
    with multiprocessing.get_context(method).Pool(2) as pool:
        there = [pool.apply_async(sweep, (flocks, [0.0, 9.0], seeds), {"num_threads": 2}) for _ in range(3)]
        there_line = pool.apply_async(sweep, (lines, [0.1], seeds))
        there_rollout = pool.apply_async(rollout, (FixedRange(25.0), seeds), {"scenario": flocks})
        for result in there:
            np.testing.assert_array_equal(result.get(TIMEOUT).min_mean_distance, here.min_mean_distance)
        np.testing.assert_array_equal(there_line.get(TIMEOUT).escape_distance, here_line.escape_distance)
        np.testing.assert_array_equal(there_rollout.get(TIMEOUT).mean_return, here_rollout.mean_return)
    # And the parent's own threads are as before.
    again = sweep(flocks, [0.0, 9.0], seeds, num_threads=2)
    np.testing.assert_array_equal(again.min_mean_distance, here.min_mean_distance)


@METHODS
@pytest.mark.parametrize("name", ["FlockEscape", "LineEscape"])
def test_async_vector_env_equals_sync_vector_env(method: str, name: str) -> None:
    scenario = small_flock(num_steps=6) if name == "FlockEscape" else LineScenario(num_agents=6, max_steps=6)
    make = functools.partial(gymnasium.make, f"flockesc_env:flockesc/{name}-v0", scenario=scenario)
    sweep(small_flock(), [1.0], range(4), num_threads=2)
    sync, parallel = SyncVectorEnv([make] * 3), AsyncVectorEnv([make] * 3, context=method)
    try:
        parallel.reset_async(seed=9)
        np.testing.assert_equal(parallel.reset_wait(TIMEOUT), sync.reset(seed=9))
        sync.action_space.seed(0)
        for _ in range(15):  # into the third episode
            actions = sync.action_space.sample()
            parallel.step_async(actions)
            np.testing.assert_equal(parallel.step_wait(TIMEOUT), sync.step(actions))
    finally:
        parallel.close(terminate=True)
        sync.close()


def large_played(num_threads: int | None) -> list[np.ndarray]:
    """Return the observations of one flock that is itself spread over threads."""
    env = FlockEscapeEnv(FlockScenario(num_agents=5000, initial_side=400.0), num_threads=num_threads)
    env.action_space.seed(0)
    observations = [env.reset(seed=4)[0]]
    return observations + [env.step(env.action_space.sample())[0] for _ in range(5)]


@METHODS
def test_child_steps_a_large_flock_after_its_parent_has(method: str) -> None:
    here = large_played(2)
    with multiprocessing.get_context(method).Pool(2) as pool:
        there = [pool.apply_async(large_played, (num_threads,)) for num_threads in (1, 2, None, 2)]
        for result in there:
            np.testing.assert_array_equal(result.get(TIMEOUT), here)
    np.testing.assert_array_equal(large_played(2), here)


def step_on(env: FlockEscapeEnv, results: SimpleQueue) -> None:
    results.put([env.step(np.array([0.0], np.float32))[0] for _ in range(5)])


def test_forked_child_goes_on_with_the_flock_of_its_parent() -> None:
    """The environment is inherited in the middle of its episode, with a pool whose threads are gone."""
    env = FlockEscapeEnv(FlockScenario(num_agents=5000, initial_side=400.0), num_threads=2)
    env.reset(seed=4)
    env.step(env.action_space.sample())
    context = multiprocessing.get_context("fork")
    results = context.SimpleQueue()
    child = context.Process(target=step_on, args=(env, results))
    child.start()
    child.join(TIMEOUT)
    assert child.exitcode == 0
    there = results.get()
    step_on(env, results)
    np.testing.assert_array_equal(there, results.get())


def played(num_threads: int | None) -> list[np.ndarray]:
    """Return the observations of flocks stepped together, into their third episode."""
    env = FlockVectorEnv(6, small_flock(num_steps=6), num_threads=num_threads)
    env.action_space.seed(0)
    observations = [env.reset(seed=4)[0]]
    return observations + [env.step(env.action_space.sample())[0] for _ in range(15)]


@METHODS
def test_child_steps_a_vector_environment_after_its_parent_has(method: str) -> None:
    here = played(2)
    with multiprocessing.get_context(method).Pool(2) as pool:
        there = [pool.apply_async(played, (num_threads,)) for num_threads in (1, 2, None, 2)]
        for result in there:
            np.testing.assert_array_equal(result.get(TIMEOUT), here)
    np.testing.assert_array_equal(played(2), here)
