"""Ctrl-C at any line of a call leaves the environment as it was or makes it ask for a reset."""

from __future__ import annotations

import copy
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from envs import ADAPTERS, REMEMBERING, Weave, draw, has_ended, plain, play, start, step
from gymnasium.error import ResetNeeded
from option_table import small_flock
from pettingzoo import AECEnv

import flockesc_env
from flockesc_env.policies.registry import built_in

PACKAGE = str(Path(flockesc_env.__file__).parent)

OTHERS = (
    "line",
    "vector without copies",
    "parallel with capture",
    "parallel with predators",
    "agent by agent",
)
MAKERS: dict[str, Callable[[], Any]] = {
    **{name: lambda make=make: make(Weave()) for name, make in REMEMBERING.items()},
    **{name: ADAPTERS[name].make for name in OTHERS},
}


def interrupted(call: Callable[[Any], Any], env: Any, line: int) -> bool:
    """Call with an interrupt at a line of the package, counted from 0; return whether there was one."""
    left = line

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal left
        if not frame.f_code.co_filename.startswith(PACKAGE):
            return None
        if event == "line":
            left -= 1
            if left < 0:
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call(env)
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(before)
    return False


def seen(call: Callable[[], Any]) -> Any:
    """Return the result of a call, or ``None`` if the environment asks for a reset."""
    try:
        return plain(copy.deepcopy(call()))
    except ResetNeeded:
        return None


CASES = [
    (interface, operation)
    for interface in MAKERS
    for operation in ("first step", "last step", "reset", "set_state")
    if (interface, operation) != ("agent by agent", "set_state")  # PettingZoo's wrappers have no snapshots
]


@pytest.mark.parametrize(("interface", "operation"), CASES)
def test_an_interrupted_call(interface: str, operation: str) -> None:
    env = MAKERS[interface]()
    start(env, 3)
    rng = np.random.default_rng(0)
    actions = draw(env, rng)
    state = env.get_state() if operation == "set_state" else b""
    for _ in range({"first step": 0, "last step": 9}.get(operation, 2)):
        ahead = copy.deepcopy(env)
        if has_ended(ahead, step(ahead, actions)):
            break
        env, actions = ahead, draw(ahead, rng)
    calls: dict[str, Callable[[Any], Any]] = {
        "reset": lambda each: start(each, 5),
        "set_state": lambda each: each.set_state(state),
    }
    call = calls.get(operation, lambda each: step(each, actions))
    twin = copy.deepcopy(env)
    next_step = seen(lambda: step(twin, actions))
    episode = [copy.deepcopy(start(twin, 4)), *play(twin, np.random.default_rng(1), 1)]
    line = 0
    while interrupted(call, twin := copy.deepcopy(env), line):
        agents = list(getattr(twin, "agents", []))
        after = seen(lambda twin=twin: step(twin, actions))
        if after is None:
            assert not agents or isinstance(twin, AECEnv)
        elif not isinstance(twin, AECEnv):  # which goes on with the agent whose action was interrupted
            np.testing.assert_equal(after, next_step, err_msg=f"line {line}")
        again = [copy.deepcopy(start(twin, 4)), *play(twin, np.random.default_rng(1), 1)]
        np.testing.assert_equal(again, episode, err_msg=f"line {line}")
        line += 1
    assert line > 5


RULES = ("stubborn-witnesses", "listen-while-threatened", "win-stay-lose-shift")


@pytest.mark.parametrize("name", RULES)
@pytest.mark.parametrize("num_actions", [0, 3])
def test_an_interrupted_policy(name: str, num_actions: int) -> None:
    """Its memory is the one before the action or the one after it."""
    entry = built_in(name)
    env = flockesc_env.parallel_env(small_flock(num_steps=40), **{"max_range": 150.0, **entry.options})
    env.reset(seed=3)
    policy: Any = entry.policy
    for _ in range(num_actions):
        rows = np.stack(list(env.step(draw(env, np.random.default_rng(0)))[0].values()))
        policy.act(rows, env.policy_spec)
    rows = np.stack(list(env.step(draw(env, np.random.default_rng(1)))[0].values()))
    uninterrupted = copy.deepcopy(policy)
    expected = [uninterrupted.act(rows, env.policy_spec).tolist() for _ in range(2)]
    line = 0
    while interrupted(lambda each: each.act(rows, env.policy_spec), twin := copy.deepcopy(policy), line):
        assert twin.act(rows, env.policy_spec).tolist() in expected
        line += 1
    assert line > 5
