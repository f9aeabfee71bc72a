"""Benchmark of a second thread: environments in Python threads, one vector environment, two upper bounds.

Cores share resources and other programs use them. Two processes with the same work, and two processes with
plain arithmetic, are therefore measured as upper bounds of the speedup.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache, partial
from multiprocessing import get_context

import numpy as np

from benchmarks import PROJECT
from benchmarks.measure import Candidate, Record, cores, measure
from flockesc_env import FlockEscapeEnv, FlockScenario, FlockVectorEnv

OWN_ENVIRONMENTS = f"{PROJECT}, a vector environment per thread"
OWN_SMALL_ENVIRONMENTS = f"{PROJECT}, an environment per thread"
ONE_BATCH = f"{PROJECT}, one vector environment"
OWN_PROCESSES = f"{PROJECT}, a vector environment per process"
ARITHMETIC = "arithmetic, a process per thread"

RANGE = 10.0
STEPS = 240
FLOCKS = 64
_ADDITIONS = 2_000_000


def run(*, quick: bool) -> list[Record]:
    """Time one and two threads: one piece of work per thread, or one vector environment on both threads."""
    with (
        ThreadPoolExecutor(2) as threads,
        ProcessPoolExecutor(2, mp_context=get_context("forkserver")) as processes,
    ):
        candidates = [
            candidate
            for count in (1, 2)
            for candidate in (
                _per_thread(OWN_ENVIRONMENTS, threads, [_vector_episode(1) for _ in range(count)]),
                _per_thread(OWN_SMALL_ENVIRONMENTS, threads, [_episode() for _ in range(count)]),
                Candidate(ONE_BATCH, _on(count, _vector_episode(count)), 1, case={"threads": count}),
                _per_thread(OWN_PROCESSES, processes, [play_in_process] * count),
                _per_thread(ARITHMETIC, processes, [add] * count),
            )
        ]
        return measure("threads", candidates, "piece of work", repetitions=3 if quick else 21, clock="wall")


def _per_thread(name: str, executor: Executor, pieces: list[Callable[[], object]]) -> Candidate:
    """Return a candidate that runs one piece of work per thread or process at the same time."""

    def at_once() -> None:
        for future in [executor.submit(piece) for piece in pieces]:
            future.result()

    return Candidate(name, at_once, len(pieces), case={"threads": len(pieces)})


def _on(count: int, work: Callable[[], object]) -> Callable[[], None]:
    def pinned() -> None:
        with cores(count):
            work()

    return pinned


def _vector_episode(num_threads: int) -> Callable[[], object]:
    env = FlockVectorEnv(
        FLOCKS, FlockScenario(num_steps=STEPS), num_threads=num_threads, copy=False, action_mode="range"
    )
    return partial(_play, env, np.full((FLOCKS, 1), RANGE, np.float32))


def _episode() -> Callable[[], object]:
    env = FlockEscapeEnv(FlockScenario(num_steps=STEPS), num_threads=1, action_mode="range")
    return partial(_play, env, np.array([RANGE], np.float32))


def _play(env: FlockVectorEnv | FlockEscapeEnv, actions: np.ndarray) -> None:
    env.reset(seed=0)
    for _ in range(STEPS):
        env.step(actions)


def play_in_process() -> None:
    """Run an episode in a worker process, with an environment that the process keeps."""
    _cached_episode()()


@cache
def _cached_episode() -> Callable[[], object]:
    return _vector_episode(1)


def add() -> int:
    """Add numbers: work that is limited neither by memory nor by other processes."""
    total = 0
    for number in range(_ADDITIONS):
        total += number
    return total
