"""Child processes after their parent has used threads; other rounding, reused ids and little memory."""

import multiprocessing
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from envs import draw, start
from forking import NOISY, forked_while, played, resumed
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv
from option_table import small_flock
from same import same
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

from flockesc_env import FlockEscapeEnv, LineScenario, rollout, sweep
from flockesc_env.policies import FixedRange

TIMEOUT = 120.0  # seconds; reached only by a child that hangs
METHODS = pytest.mark.parametrize("method", ["fork", "forkserver", "spawn"])

# Python warns about forks with threads, which this file tests.
pytestmark = pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")


@METHODS
def test_a_child_can_sweep_and_step_after_its_parent(method: str) -> None:
    env = FlockEscapeEnv(NOISY, action_mode="range")
    env.reset(seed=1)
    env.step(np.array([10.0], np.float32))
    flocks, seeds = small_flock(num_agents=30), range(8)
    calls: list[tuple[Callable[..., Any], tuple[Any, ...]]] = [
        *[(partial(sweep, num_threads=2), (flocks, [0.0, 9.0], seeds))] * 3,
        (sweep, (LineScenario(), [0.1], seeds)),
        (rollout, (flocks, FixedRange(25.0), seeds)),
        *((played, (num_threads,)) for num_threads in (1, 2, None, 2)),
        (resumed, (env.get_state(),)),
    ]
    here = [call(*arguments) for call, arguments in calls]
    with multiprocessing.get_context(method).Pool(2) as pool:
        there = [pool.apply_async(*each) for each in calls]
        same([result.get(TIMEOUT) for result in there], here)
    same([call(*arguments) for call, arguments in calls], here)  # the parent's threads still work


@pytest.mark.parametrize(
    ("kind", "method", "name"),
    [
        ("AsyncVectorEnv", "fork", "FlockEscape"),
        ("AsyncVectorEnv", "forkserver", "LineEscape"),
        ("AsyncVectorEnv", "spawn", "FlockEscape"),
        ("SubprocVecEnv", "fork", "FlockEscape"),  # spawned ones import torch, which takes seconds
    ],
)
def test_environments_in_processes_equal_those_in_one(kind: str, method: str, name: str) -> None:
    scenario = small_flock(num_steps=24) if name == "FlockEscape" else LineScenario(num_agents=6, max_steps=6)
    make = partial(gymnasium.make, f"flockesc_env:flockesc/{name}-v1", scenario=scenario)
    sweep(small_flock(), [1.0], range(4), num_threads=2)
    here: Any
    there: Any
    if kind == "AsyncVectorEnv":
        here, there = SyncVectorEnv([make] * 3), AsyncVectorEnv([make] * 3, context=method)
    else:
        here, there = DummyVecEnv([make] * 3), SubprocVecEnv([make] * 3, start_method=method)
    try:
        np.testing.assert_equal(start(there, 9), start(here, 9))
        rng = np.random.default_rng(0)
        for _ in range(15):  # into the third episode
            actions = draw(here, rng)
            (rows, rewards, *rest), expected = there.step(actions), here.step(actions)
            rewards = rewards.astype(expected[1].dtype)  # DummyVecEnv rounds to float32
            np.testing.assert_equal((rows, rewards, *rest), expected)
    finally:
        there.close()
        here.close()


@pytest.mark.parametrize("busy", ["step_for_ever", "start_pools", "sweep_for_ever"])
def test_fork_while_another_thread_is_busy(busy: str) -> None:
    assert forked_while(busy, count=24) == {"children": 24, "hung": 0, "wrong": 0}


ROUNDING = """
import ctypes, platform
from flockesc_env import FlockescError, FlockEscapeEnv, FlockScenario, LineEscapeEnv, LineScenario
from flockesc_env import rollout, simulate, simulate_line, sweep
from flockesc_env.policies import FixedRange

fesetround = ctypes.CDLL(None).fesetround
NEAREST, DOWN, UP, TO_ZERO = 0, 0x400, 0x800, 0xC00
flock, line = FlockScenario(num_agents=5, num_steps=9), LineScenario(max_steps=9)
env, line_env = FlockEscapeEnv(flock, num_threads=2), LineEscapeEnv(line)
actions = env.action_space.sample(), line_env.action_space.sample()
env.reset(seed=0)
line_env.reset(seed=0)
calls = {
    "step": lambda: env.step(actions[0]),
    "step of a line": lambda: line_env.step(actions[1]),
    "reset": lambda: FlockEscapeEnv(flock).reset(seed=0),
    "reset of a line": lambda: LineEscapeEnv(line).reset(seed=0),
    "rollout": lambda: rollout(flock, FixedRange(9.0), range(2)),
    "simulate": lambda: simulate(flock, 9.0, seed=0),
    "simulate_line": lambda: simulate_line(line, 0.1, seed=0),
    "sweep": lambda: sweep(flock, [9.0], range(2)),
    "sweep of lines": lambda: sweep(line, [0.1], range(2)),
}
states = env.get_state(), line_env.get_state()
for mode in (DOWN, UP, TO_ZERO):
    for name, call in calls.items():
        assert fesetround(mode if platform.machine() == "x86_64" else mode << 12) == 0
        try:
            call()
        except FlockescError as error:
            assert "does not round to nearest" in str(error), error
        else:
            raise AssertionError(f"{name} under {mode:#x}")
        finally:
            fesetround(NEAREST)
assert (env.get_state(), line_env.get_state()) == states
for call in calls.values():
    call()
"""


@pytest.mark.skipif(
    os.name != "posix" or platform.machine() not in {"x86_64", "aarch64", "arm64"},
    reason="sets rounding modes of x86-64 and ARM through the C library",
)
def test_rounding_modes_other_than_to_nearest_are_refused() -> None:
    """Results would differ by bits. Threads inherit the mode of the thread that starts them."""
    subprocess.run([sys.executable, "-c", ROUNDING], check=True, timeout=TIMEOUT)  # noqa: S603


NAMESPACES = """
import ctypes, os, sys
from flockesc_env import FlockScenario, sweep

def new_process_ids():
    if ctypes.CDLL(None).unshare(0x20000000):  # CLONE_NEWPID
        os._exit(77)

def descend(generations):
    child = os.fork()
    if child:
        sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    assert os.getpid() == 1
    sweep(FlockScenario(num_agents=5, num_steps=5), [1.0], range(4), num_threads=2)
    if generations:
        new_process_ids()
        descend(generations - 1)
    os._exit(0)

new_process_ids()
descend(1)
"""


def test_child_with_the_process_id_of_its_parent() -> None:
    """Containers restart process ids, and long-lived machines reuse them."""
    command = [sys.executable, "-W", "ignore", "-c", NAMESPACES]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT)  # noqa: S603
    if ended.returncode == 77:
        pytest.skip("needs the right to make a namespace of process ids")
    assert ended.returncode == 0, ended.stderr


# Each call needs far more than the 512 MiB that the process gets.
MEMORY_CALLS = """
laplacian(np.zeros(100_000), 1.0)
neighbor_pairs(None, place, 1.0)
simulate(crowd, 1e9)
simulate(flock.replace(num_steps=10**9), 1.0)
simulate_line(endless, 10.0, initial_state=[0.36, 0.68] * 50_000)
sweep(flock, [1.0], range(10**9))
sweep(flock, np.ones(10_000), range(100_000))
sweep(flock.replace(num_agents=10**7), [1.0], [0])
rollout(flock, FixedRange(1.0), range(10**12))
LineEscapeEnv(LineScenario(num_agents=10**7)).reset(seed=0)
BatchVectorEnv(100_000, flock)
FlockEscapeEnv(flock.replace(num_agents=10**7))
FlockEscapeEnv(flock.replace(sensing_delay=10**8, num_steps=10**9))
frozen.step(np.array([[0.1], [1e9]], np.float32))
"""

MEMORY = """
import resource
import numpy as np
from flockesc_env import *
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.models.graph import laplacian, neighbor_pairs

flock, place = FlockScenario(num_agents=10), np.zeros((100_000, 2))
crowd = FlockScenario(num_agents=100_000, num_steps=9, frozen_graph=True)
# Two groups that chase each other past the predator for ever.
endless = LineScenario(num_agents=100_000, escape_force="linear_as_printed", max_steps=10**9)
options = dict(action_mode="range", max_range=1e9, num_threads=1)
frozen, twin = (BatchVectorEnv(2, crowd, **options) for _ in range(2))
for env in (frozen, twin):
    env.reset(seed=0)
# The first call starts the threads of the package, whose stacks are address space.
sweep(flock.replace(num_steps=1), [1.0], range(2))
most = 1024 * int(open("/proc/self/status").read().split("VmSize:")[1].split()[0]) + 2**29
resource.setrlimit(resource.RLIMIT_AS, (most, most))
for call in CALLS.strip().split("\\n"):
    try:
        eval(call)
    except MemoryError as error:
        assert str(error), call
    else:
        raise AssertionError(call)
steps = [env.step(np.full((2, 1), 0.1, np.float32)) for env in (frozen, twin)]
assert all(np.array_equal(*pair) for pair in zip(*(step[:2] for step in steps)))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="RLIMIT_AS and /proc are Linux's")
def test_memory_errors_leave_the_environment_usable() -> None:
    script = f"CALLS = {MEMORY_CALLS!r}\n{MEMORY}"
    subprocess.run([sys.executable, "-c", script], check=True, timeout=TIMEOUT)  # noqa: S603
