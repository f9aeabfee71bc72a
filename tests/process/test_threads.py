"""Python threads: separate environments are independent; a shared one refuses two calls at once."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from envs import ADAPTERS, play, start
from option_table import small_flock

import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv

THREADS = 8
CYCLE = [0.36, 0.68] * 50
"""A line that oscillates forever around the predator, so the episode never becomes steady."""
TEN = np.array([10.0], np.float32)
CROWD = fe.FlockScenario(num_agents=600, initial_side=140.0, num_steps=20_000)
ENDLESS = fe.LineScenario(escape_force="linear_as_printed", max_steps=10**6)
SHARED: dict[str, Callable[[int], Any]] = {
    "flock": lambda steps: fe.FlockEscapeEnv(CROWD, action_mode="range", steps_per_action=steps),
    "batch": lambda steps: BatchVectorEnv(
        12, CROWD.replace(num_agents=100), num_threads=2, action_mode="range", steps_per_action=steps
    ),
    "line": lambda steps: fe.LineEscapeEnv(
        ENDLESS, action_mode="range", max_range=10.0, steps_per_action=steps
    ),
}


@pytest.fixture(autouse=True)
def threads_alternate_often() -> Iterator[None]:
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(usual)


def at_once(work: Callable[[int], Any]) -> list[Any]:
    """Return the results of ``work(0)``, ``work(1)``, ..., started by all threads at the same time."""
    barrier = threading.Barrier(THREADS, timeout=60)

    def begin(index: int) -> Any:
        barrier.wait()
        return work(index)

    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(begin, range(THREADS)))


def played(env: Any, index: int) -> list[Any]:
    return [start(env, index), *play(env, np.random.default_rng(index), 9)]


def assert_serial(work: Callable[[int], Any]) -> None:
    for there, here in zip(at_once(work), map(work, range(THREADS)), strict=True):
        np.testing.assert_equal(there, here)


# SDL draws in one thread.
@pytest.mark.parametrize("name", [name for name in ADAPTERS if not ADAPTERS[name].has_pictures])
def test_eight_threads_give_serial_results(name: str) -> None:
    assert_serial(lambda index: played(ADAPTERS[name].make(), index))


def test_eight_threads_share_one_pool() -> None:
    """Large flocks, batches and sweeps share the same two threads of the core."""
    large = fe.FlockScenario(num_agents=5000, initial_side=400.0, num_steps=6)
    small = small_flock()

    def work(index: int) -> Any:
        if index % 4 == 0:
            return fe.simulate(large, 10.0, seed=index, num_threads=2).positions
        if index % 4 == 1:
            return fe.sweep(small, [1.0, 9.0], range(index, index + 30), num_threads=2).min_mean_distance
        if index % 4 == 2:
            return fe.rollout(small, fe.FixedRange(9.0), range(index, 40), num_threads=2).mean_return
        return played(fe.FlockEscapeEnv(large, num_threads=2, steps_per_action=1), index)

    assert_serial(work)


def started(name: str, steps_per_action: int) -> tuple[Any, np.ndarray]:
    """Return an environment in an episode and its action of 10."""
    env = SHARED[name](steps_per_action)
    env.reset(seed=5, options={"initial_state": CYCLE} if name == "line" else None)
    return env, np.resize(TEN, env.action_space.shape)


@pytest.mark.parametrize("name", SHARED)
def test_threads_sharing_an_environment_take_turns_or_are_refused(name: str) -> None:
    (shared, action), (alone, _) = started(name, 1), started(name, 1)
    refusals: list[fe.FlockescError] = []

    def step(index: int) -> list[bytes]:
        stepped = []
        for _ in range(12):
            try:
                stepped.append(shared.step(action)[0].tobytes())
            except fe.FlockescError as error:
                refusals.append(error)
        return stepped

    stepped = [observation for each in at_once(step) for observation in each]
    assert all("environment" in str(error) for error in refusals)
    # Every step ran once and completely, in some order, and the next step continues from there.
    assert sorted(stepped) == sorted([alone.step(action)[0].tobytes() for _ in stepped])
    np.testing.assert_equal(shared.step(action), alone.step(action))


@pytest.mark.parametrize(("name", "steps"), [("flock", 5_000), ("line", 10**6)])
def test_reading_during_a_long_step_is_refused(name: str, steps: int) -> None:
    env, action = started(name, steps)

    def step() -> None:
        while True:
            try:
                env.step(action)
            except fe.FlockescError:  # a read that began before the step refuses it
                continue
            return

    stepping = threading.Thread(target=step, daemon=True)
    stepping.start()
    refusals = []
    while stepping.is_alive():
        try:
            env.get_state()
            time.sleep(0.001)  # the step has not begun
        except fe.FlockescError as error:
            refusals.append(error)
    assert refusals
    assert all("environment" in str(error) for error in refusals)
    env.get_state()
