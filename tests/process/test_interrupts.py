"""Ctrl-C or an exception in a callback stops a call that would run for hours; the process still works."""

import subprocess
import sys
import textwrap

import pytest
from long_calls import interrupted

TIMEOUT = 60  # seconds; reached only by a call that does not stop

PRELUDE = """
import os, signal, sys
import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv

signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits none
flock = fe.FlockScenario(num_steps=10**9, num_agents=20)
# Two groups that chase each other past the predator for ever; seeds 2 and 3 end in the like.
cycle = [0.36, 0.68] * 50
line = fe.LineScenario(escape_force="linear_as_printed", max_steps=10**9)
pair = line.replace(num_agents=2)

def interrupt_next_call():
    # After 0.1 s of processor time: on a busy machine, too, the signal comes during the call.
    signal.signal(signal.SIGVTALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.1)

def check():
    small = fe.sweep(fe.FlockScenario(num_agents=5, num_steps=5), [1.0], range(4))
    assert small.min_mean_distance.shape == (1, 4)
    print("works", flush=True)
"""


def lines_of(script: str) -> list[str]:
    """Run a script in a process and return the lines that it prints."""
    command = [sys.executable, "-c", PRELUDE + textwrap.dedent(script)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT)  # noqa: S603
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.splitlines()


@pytest.mark.parametrize(
    "name",
    [
        *("sweep", "sweep with progress", "sweep, lines", "simulate, a step takes long", "simulate_line"),
        *("rollout", "a network of many rows"),
    ],
)
def test_ctrl_c_stops_a_call(name: str) -> None:
    """tests/slow/test_interrupt_latency.py measures how soon, in all calls."""
    assert interrupted(name, 1) != [None]


# Environments in which one step would take hours.
STEPS = {
    "gymnasium": """
        env = FlockEscapeEnv(flock, steps_per_action=10**9, action_mode="range")
        act = lambda: env.step(np.array([1.0], np.float32))
    """,
    "vector": """
        env = BatchVectorEnv(3, flock, copy=False, steps_per_action=10**9, action_mode="range", num_threads=2)
        act = lambda: env.step(np.ones((3, 1), np.float32))
    """,
    "parallel": """
        env = parallel_env(flock, steps_per_action=10**9, action_mode="range", reward="difference")
        act = lambda: env.step(dict.fromkeys(env.possible_agents, np.ones(1, np.float32)))
    """,
}


@pytest.mark.parametrize("interface", STEPS)
def test_ctrl_c_during_a_step_of_hours_requires_a_reset(interface: str) -> None:
    printed = lines_of(f"""
        import numpy as np
        from gymnasium.error import ResetNeeded
        from flockesc_env import FlockEscapeEnv, parallel_env
        {STEPS[interface]}
        for seed in range(2):
            env.reset(seed=seed)
            try:
                interrupt_next_call()
                act()
            except KeyboardInterrupt:
                print("interrupted", flush=True)
            try:
                act()
            except ResetNeeded:
                print("needs a reset", getattr(env, "agents", []), flush=True)
        check()
    """)
    assert printed == ["interrupted", "needs a reset []"] * 2 + ["works"]


SCRIPTS: dict[str, tuple[str, list[str]]] = {
    "an exception in progress stops the sweep": (
        """
        calls = []

        def stop(done, total):
            calls.append((done, total))
            raise ZeroDivisionError

        for scenario in (flock, pair):
            try:
                fe.sweep(scenario, [1.0], [2, 3], progress=stop)
            except ZeroDivisionError:
                print(len(calls), flush=True)
        """,
        ["1", "2"],
    ),
    "a long step of a line is undone": (
        """
        import numpy as np
        env = fe.LineEscapeEnv(line, action_mode="range", max_range=10.0, steps_per_action=10**9)
        env.reset(seed=0, options={"initial_state": cycle})
        state = env.get_state()
        try:
            interrupt_next_call()
            env.step(np.array([10.0], np.float32))
        except KeyboardInterrupt:
            print(env.get_state() == state, flush=True)
        """,
        ["True"],
    ),
    "a step of some milliseconds in a worker thread ends": (
        """
        import numpy as np
        env = BatchVectorEnv(220, fe.FlockScenario(), autoreset_mode="SameStep")
        env.reset(seed=0)
        for _ in range(5):
            try:
                interrupt_next_call()
                while True:
                    env.step(-np.ones((220, 1), np.float32))
            except KeyboardInterrupt:
                print("interrupted", flush=True)
        """,
        ["interrupted"] * 5,
    ),
    "the threads of a scan end": (
        """
        signal.signal(signal.SIGALRM, signal.default_int_handler)
        signal.setitimer(signal.ITIMER_REAL, 1.0)  # reaches the main thread, which waits
        try:
            fe.scan(flock, {}, 1.0, range(9), every=10**9)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        """,
        ["interrupted"],
    ),
    "a handler that does not raise lets the sweep finish": (
        """
        seen, count = [], 50
        signal.signal(signal.SIGALRM, lambda *_: seen.append(1))
        signal.setitimer(signal.ITIMER_REAL, 0.01, 0.01)
        while not seen:
            count *= 2  # until the sweep takes longer than the timer
            result = fe.sweep(fe.FlockScenario(), [10.0], range(count))
        signal.setitimer(signal.ITIMER_REAL, 0)
        print(result.min_mean_distance.shape == (1, count), flush=True)
        """,
        ["True"],
    ),
    # NumPy's C API is loaded with the package: an import within a call would run the signal's handler.
    "a signal before the first array is a KeyboardInterrupt": (
        """
        import ctypes, functools
        from flockesc_env.episodes.starts import RESET_OPTIONS
        env = fe.FlockEscapeEnv(flock)

        class First:  # the index 0; no Python code runs before the core has returned
            __index__ = functools.partial(ctypes.CDLL(None)["raise"], signal.SIGINT)

        try:
            env._batch.core.reset([First()], [0], [dict.fromkeys(RESET_OPTIONS)])
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        env.reset(seed=0)
        """,
        ["interrupted"],
    ),
    "a child forked by a callback does not wait for its parent's call": (
        """
        parent = os.getpid()

        def fork(done, total):
            if os.getpid() == parent and not children:
                children.append(os.fork())

        children = []
        try:
            fe.sweep(fe.FlockScenario(num_steps=20_000), [10.0], range(4), progress=fork)
        except RuntimeError as error:
            print(error, flush=True)
            os._exit(7)
        assert os.waitstatus_to_exitcode(os.waitpid(children[0], 0)[1]) == 7
        """,
        ["the process was forked during this call; only the parent process can finish the call"],
    ),
}


@pytest.mark.parametrize(("script", "expected"), SCRIPTS.values(), ids=SCRIPTS)
def test_callbacks_and_signals(script: str, expected: list[str]) -> None:
    assert lines_of(f"{script}\n        check()") == [*expected, "works"]
