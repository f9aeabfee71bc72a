"""What a second thread is worth, on the wall: environments in Python threads, one batch, and two ceilings.

Cores may share parts, and others may be at work on them: two threads can gain what two processes gain that do
the same work, or plain arithmetic, and no more.
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
    """Time the same work per thread on one thread and on two; one batch has the same work in all."""
    with (
        ThreadPoolExecutor(2) as threads,
        ProcessPoolExecutor(2, mp_context=get_context("forkserver")) as processes,
    ):
        contenders = [
            contender
            for count in (1, 2)
            for contender in (
                _per_thread(OWN_ENVIRONMENTS, threads, [_vector_episode(1) for _ in range(count)]),
                _per_thread(OWN_SMALL_ENVIRONMENTS, threads, [_episode() for _ in range(count)]),
                Candidate(ONE_BATCH, _on(count, _vector_episode(count)), 1, case={"threads": count}),
                _per_thread(OWN_PROCESSES, processes, [play_apart] * count),
                _per_thread(ARITHMETIC, processes, [add] * count),
            )
        ]
        return measure("threads", contenders, "piece of work", repetitions=3 if quick else 21, clock="wall")


def _per_thread(name: str, executor: Executor, pieces: list[Callable[[], object]]) -> Candidate:
    """Return a contender that does one piece per thread or process, all at once."""

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


def play_apart() -> None:
    """Play an episode in a process that keeps its environment."""
    _kept_episode()()


@cache
def _kept_episode() -> Callable[[], object]:
    return _vector_episode(1)


def add() -> int:
    """Add numbers, which needs neither memory nor another process."""
    total = 0
    for number in range(_ADDITIONS):
        total += number
    return total
