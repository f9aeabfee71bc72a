"""Forks while other threads are busy, in a separate process.

The process prints a JSON object: children started, children that hung, and children whose results differ from
the parent's.
"""

import json
import multiprocessing
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import numpy as np

from flockesc_env import FlockEscapeEnv, FlockScenario, sweep
from flockesc_env.envs.vector import BatchVectorEnv

HANGS = 60.0  # seconds; reached only by a child that hangs
LARGE = FlockScenario(num_agents=5000, initial_side=400.0)
SMALL = FlockScenario(num_agents=20, num_steps=8, initial_side=40.0)
NOISY = SMALL.replace(num_steps=20, angular_noise=1.0, sensing_noise=0.5, sensing_delay=2)


def forked_while(*busy: str, count: int) -> dict[str, int]:
    """Return the outcome of forks while threads of the parent ran functions of this module."""
    # Python warns about forks with threads.
    command = [sys.executable, "-W", "ignore", __file__, str(count), *busy]
    return json.loads(subprocess.check_output(command))  # noqa: S603


def played(num_threads: int | None) -> bytes:
    """Return the observations of a large flock, split over threads, and of a batch of small ones."""
    large = FlockEscapeEnv(LARGE, num_threads=num_threads, action_mode="range")
    shown = [large.reset(seed=4)[0]]
    shown += [large.step(np.array([10.0], np.float32))[0] for _ in range(3)]
    small = BatchVectorEnv(5, SMALL, num_threads=num_threads, action_mode="range")
    shown += [small.reset(seed=4)[0]]
    shown += [small.step(np.full((5, 1), 10.0, np.float32))[0] for _ in range(10)]
    return b"".join(observations.tobytes() for observations in shown)


def resumed(state: bytes) -> bytes:
    """Return the observations of a noisy flock after a snapshot, across the end of an episode."""
    env = FlockEscapeEnv(NOISY, num_threads=2, action_mode="range")
    shown = [env.set_state(state)]
    while not (stepped := env.step(np.array([10.0], np.float32)))[3]:
        shown.append(stepped[0])
    return b"".join(observation.tobytes() for observation in (*shown, stepped[0], env.reset()[0]))


def step_for_ever(stop: threading.Event) -> None:
    """Keep the pool of two threads busy with one large flock."""
    env = FlockEscapeEnv(LARGE, num_threads=2, action_mode="range")
    while not stop.is_set():
        env.reset(seed=1)
        for _ in range(20):
            env.step(np.array([10.0], np.float32))


def start_pools(stop: threading.Event) -> None:
    for num_threads in range(200, 212):
        if not stop.is_set():
            sweep(SMALL, [1.0], range(2), num_threads=num_threads)


def sweep_for_ever(stop: threading.Event) -> None:
    while not stop.is_set():
        sweep(SMALL, [1.0, 10.0], range(200), num_threads=2)


def run(busy: list[Callable[[threading.Event], None]], count: int) -> dict[str, int]:
    """Fork ``count`` times while the threads are busy."""
    expected, stop = played(2), threading.Event()
    threads = [threading.Thread(target=work, args=(stop,)) for work in busy]
    for thread in threads:
        thread.start()
    children = [
        multiprocessing.get_context("fork").Process(target=check, args=(expected, 2 + index % 3))
        for index in range(count)
    ]
    for index, child in enumerate(children):
        child.start()
        time.sleep(0.001 * (index % 4))
        if index % 8 == 7:
            children[index - 7].join(HANGS)
    for child in children:
        child.join(HANGS)
    exits = [child.exitcode for child in children]
    for child in children:
        child.kill()
    stop.set()
    return {"children": count, "hung": exits.count(None), "wrong": count - exits.count(None) - exits.count(0)}


def check(expected: bytes, num_threads: int) -> None:
    os._exit(played(num_threads) != expected)


if __name__ == "__main__":
    print(json.dumps(run([globals()[name] for name in sys.argv[2:]], int(sys.argv[1]))))
