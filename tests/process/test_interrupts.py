"""Ctrl-C or an exception in a callback stops a call that would run for hours; the process still works."""

import subprocess
import sys
import textwrap
from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
import pytest

import flockesc_env as fe
from flockesc_env.envs.gymnasium import PredatorEnv
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.policies import Pursue
from flockesc_env.sb3 import vec_env

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

def check():
    small = sweep(FlockScenario(num_agents=5, num_steps=5), [1.0], range(4))
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
    "call",
    [
        "sweep(flock, [1.0], range(2))",
        "sweep(flock, [1.0, 2.0], range(10), progress=lambda done, total: None)",
        "sweep(pair, [1.0], [2, 3])",
        "simulate_line(line, 10.0, initial_state=cycle)",
        "simulate(crowd, 1e3, seed=0)",
        "rollout(flock, FixedRange(10.0), range(100))",
        "network.act(np.zeros((1_000_000, len(names)), np.float32), spec)",
    ],
)
def test_ctrl_c_stops_a_call(call: str) -> None:
    """The outputs of the network take minutes for all rows on any processor."""
    printed = lines_of(f"""
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
    assert printed == ["interrupted", "works"]


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
                sweep(scenario, [1.0], [2, 3], progress=stop)
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
        env = BatchVectorEnv(220, FlockScenario(), autoreset_mode="SameStep")
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
    "a handler that does not raise lets the sweep finish": (
        """
        seen, count = [], 50
        signal.signal(signal.SIGALRM, lambda *_: seen.append(1))
        signal.setitimer(signal.ITIMER_REAL, 0.01, 0.01)
        while not seen:
            count *= 2  # until the sweep takes longer than the timer
            result = sweep(FlockScenario(), [10.0], range(count))
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
            sweep(FlockScenario(num_steps=20_000), [10.0], range(4), progress=fork)
        except RuntimeError as error:
            print(error, flush=True)
            os._exit(7)
        assert os.waitstatus_to_exitcode(os.waitpid(children[0], 0)[1]) == 7
        """,
        ["the process was forked during this call; only the parent process can finish the call"],
    ),
}


caught = fe.FlockScenario(num_agents=5, num_steps=3, initial_side=20.0, capture_radius=30.0)
steered = caught.with_learned_predators()
one_each = {"action_mode": "range", "steps_per_action": 1}
ENVIRONMENTS: dict[str, Callable[[], Any]] = {
    "gymnasium": lambda: fe.FlockEscapeEnv(steered, predator_policy=Pursue(), **one_each),
    "predator": lambda: PredatorEnv(steered, **one_each),
    "line": lambda: fe.LineEscapeEnv(fe.LineScenario(num_agents=5), **one_each),
    "parallel": lambda: fe.parallel_env(steered, **one_each),
    "next step": lambda: BatchVectorEnv(3, caught, autoreset_mode="NextStep", **one_each),
    "same step": lambda: BatchVectorEnv(3, caught, autoreset_mode="SameStep", **one_each),
    "at a limit": lambda: BatchVectorEnv(
        3, caught, autoreset_mode="SameStep", max_episode_steps=2, **one_each
    ),
    "stable-baselines3": lambda: vec_env(caught, 3, **one_each),
}
AUTORESET = {"next step", "same step", "at a limit", "stable-baselines3"}


def interrupted(call: Callable[[], Any], line: int) -> bool:
    """Call with a Ctrl-C before a line of the package, counted from 1; return False if it ends before."""
    lines = count(1)

    def trace(frame: Any, event: str, _: Any) -> Any:
        is_here = "flockesc_env" in frame.f_code.co_filename
        if is_here and event == "line" and next(lines) == line:
            raise KeyboardInterrupt
        return trace if is_here else None

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_ctrl_c_anywhere_in_a_step_keeps_the_episodes(name: str) -> None:
    """The state is the one before or after the step, names fit it, and the next step works."""
    env = ENVIRONMENTS[name]()

    def step() -> None:
        if name == "parallel":
            env.step({agent: np.zeros(env.action_space(agent).shape, np.float32) for agent in env.agents})
        else:
            env.step(np.zeros((3, 1) if name == "stable-baselines3" else env.action_space.shape, np.float32))

    def has_ended() -> bool:
        return bool(env._episode.has_ended if name == "line" else env._batch.core.ended().all())

    env.reset(**({} if name == "stable-baselines3" else {"seed": 0}))
    for _ in range(4):
        state = env.get_state()
        step()
        states = {state, after := env.get_state()}
        for line in count(1):
            env.set_state(state)
            is_interrupted = interrupted(step, line)
            if name in AUTORESET:
                step()
            else:
                assert env.get_state() in states
                if not has_ended():
                    step()
            if not is_interrupted:
                break
        env.set_state(after)
        if has_ended() and name not in AUTORESET:
            break


@pytest.mark.parametrize(("script", "expected"), SCRIPTS.values(), ids=SCRIPTS)
def test_callbacks_and_signals(script: str, expected: list[str]) -> None:
    assert lines_of(f"{script}\n        check()") == [*expected, "works"]
