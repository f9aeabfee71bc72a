"""Ctrl-C or an exception in a callback stops a call that would run for hours; the process still works."""

import signal
import subprocess
import sys
import textwrap

import pytest

TIMEOUT = 60  # seconds; reached only by a call that does not stop

PRELUDE = """
import os, signal, sys
import flockesc_env as fe
from flockesc_env.policies import Architecture
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env import FixedRange, FlockScenario, LineScenario, rollout, simulate, simulate_line, sweep

signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits none
flock = FlockScenario(num_steps=10**9, num_agents=20)
crowd = FlockScenario(num_steps=2_000, num_agents=2_000)  # its record takes 130 MB
# Two groups that chase each other past the predator for ever; seeds 2 and 3 end in the like.
cycle = [0.36, 0.68] * 50
line = LineScenario(escape_force="linear_as_printed", max_steps=10**9)
pair = line.replace(num_agents=2)

def interrupt_next_call():
    # After 0.1 s of processor time: on a busy machine, too, the signal comes during the call.
    signal.signal(signal.SIGVTALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.1)

def interrupt(done, total):
    print("running", flush=True)

def check():
    small = sweep(FlockScenario(num_agents=5, num_steps=5), [1.0], range(4))
    assert small.min_mean_distance.shape == (1, 4)
    print("works", flush=True)
"""


def start(script: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", PRELUDE + textwrap.dedent(script)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # noqa: S603


def finish(process: subprocess.Popen[str]) -> str:
    try:
        output, errors = process.communicate(timeout=TIMEOUT)
    finally:
        process.kill()
    assert process.returncode == 0, errors
    return output


def test_ctrl_c_stops_a_sweep() -> None:
    process = start("""
        try:
            sweep(flock, [1.0, 2.0], range(10), progress=interrupt)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        check()
    """)
    assert process.stdout is not None
    assert process.stdout.readline() == "running\n"
    process.send_signal(signal.SIGINT)
    assert finish(process).splitlines()[-2:] == ["interrupted", "works"]


@pytest.mark.parametrize(
    "call",
    [
        "sweep(flock, [1.0], range(2))",
        "sweep(pair, [1.0], [2, 3])",
        "simulate_line(line, 10.0, initial_state=cycle)",
        "simulate(crowd, 1e3, seed=0)",
        "rollout(flock, FixedRange(10.0), range(100))",
        "network.act(np.zeros((1_000_000, len(names)), np.float32), spec)",
    ],
)
def test_ctrl_c_without_progress(call: str) -> None:
    """The outputs of the network take minutes for all rows on any processor."""
    process = start(f"""
        import numpy as np
        spec = fe.FlockEscapeEnv(flock).policy_spec
        names = spec.layout.names
        architecture = Architecture(names, (2_000, 2_000))
        network = fe.NetworkPolicy(architecture, np.zeros(architecture.size))
        try:
            interrupt_next_call()
            {call}
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        check()
    """)
    assert finish(process).splitlines() == ["interrupted", "works"]


def test_an_exception_in_progress_stops_the_sweep() -> None:
    process = start("""
        class Enough(Exception):
            pass

        calls = []

        def stop(done, total):
            calls.append((done, total))
            raise Enough

        for scenario in (flock, pair):
            try:
                sweep(scenario, [1.0], [2, 3], progress=stop)
            except Enough:
                print(len(calls), flush=True)
        check()
    """)
    assert finish(process).splitlines() == ["1", "2", "works"]


def test_a_handler_that_does_not_raise_lets_the_sweep_finish() -> None:
    process = start("""
        seen, count = [], 50
        signal.signal(signal.SIGALRM, lambda *_: seen.append(1))
        signal.setitimer(signal.ITIMER_REAL, 0.01, 0.01)
        while not seen:
            count *= 2  # until the sweep takes longer than the timer
            result = sweep(FlockScenario(), [10.0], range(count))
        signal.setitimer(signal.ITIMER_REAL, 0)
        print(result.min_mean_distance.shape == (1, count), flush=True)
    """)
    assert finish(process) == "True\n"


def test_a_signal_before_the_first_array_is_a_keyboard_interrupt() -> None:
    """NumPy's C API is loaded with the package: an import within a call would run the signal's handler."""
    process = start("""
        import ctypes, functools
        from flockesc_env import FlockEscapeEnv
        from flockesc_env.episodes.starts import NO_START
        env = FlockEscapeEnv(flock)

        class First:  # the index 0; no Python code runs before the core has returned
            __index__ = functools.partial(ctypes.CDLL(None)["raise"], signal.SIGINT)

        try:
            env._batch._core.reset([First()], [0], [NO_START])
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        env.reset(seed=0)
        check()
    """)
    assert finish(process).splitlines() == ["interrupted", "works"]


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
    "line": """
        env = LineEscapeEnv(line, steps_per_action=10**9, action_mode="range", max_range=10.0)
        options = {"initial_state": cycle}
        act = lambda: env.step(np.array([10.0], np.float32))
    """,
}


@pytest.mark.parametrize("interface", STEPS)
def test_ctrl_c_during_a_step_requires_a_reset(interface: str) -> None:
    process = start(f"""
        import numpy as np
        from gymnasium.error import ResetNeeded
        from flockesc_env import FlockEscapeEnv, LineEscapeEnv, parallel_env
        options = None
        {STEPS[interface]}
        for seed in range(2):
            env.reset(seed=seed, options=options)
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
    assert finish(process).splitlines() == ["interrupted", "needs a reset []"] * 2 + ["works"]


def test_a_child_forked_by_a_callback_does_not_wait_for_its_parents_call() -> None:
    process = start("""
        parent = os.getpid()

        def fork(done, total):
            if os.getpid() == parent and not children:
                children.append(os.fork())

        children = []
        try:
            sweep(FlockScenario(num_steps=20_000), [10.0], range(4), progress=fork)
        except RuntimeError as error:
            print(error, flush=True)
            os._exit(7)
        assert os.waitstatus_to_exitcode(os.waitpid(children[0], 0)[1]) == 7
        check()
    """)
    refused = "the process was forked during this call; only the parent process can finish the call"
    assert finish(process).splitlines() == [refused, "works"]
