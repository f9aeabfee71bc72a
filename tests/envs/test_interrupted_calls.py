"""After Ctrl-C during a step, the environment asks for a reset and then works as before."""

import copy
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from envs import ADAPTERS, REMEMBERING, Weave, draw, play, start, step
from gymnasium.error import ResetNeeded

import flockesc_env

PACKAGE = str(Path(flockesc_env.__file__).parent)

OTHERS = ("line", "vector without copies", "parallel with capture", "parallel with predators")
MAKERS: dict[str, Callable[[], Any]] = {
    **{name: lambda make=make: make(Weave()) for name, make in REMEMBERING.items()},
    **{name: ADAPTERS[name].make for name in OTHERS},
}


def lines_before(stop: float, call: Callable[[], Any]) -> int:
    """Call, raise KeyboardInterrupt after ``stop`` lines of the package, and return the number of lines."""
    lines = 0

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal lines
        if not frame.f_code.co_filename.startswith(PACKAGE):
            return None
        if event == "line":
            lines += 1
            if lines > stop:
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    finally:
        sys.settrace(before)
    return lines


@pytest.mark.parametrize("interface", MAKERS)
def test_ctrl_c_during_a_step_requires_a_reset(interface: str) -> None:
    env = MAKERS[interface]()
    start(env, 3)
    play(env, np.random.default_rng(0), 2)
    actions, twin, other = draw(env, np.random.default_rng(0)), copy.deepcopy(env), copy.deepcopy(env)
    lines = lines_before(np.inf, lambda: step(other, actions))
    with pytest.raises(KeyboardInterrupt):
        lines_before(lines // 2, lambda: step(env, actions))
    with pytest.raises(ResetNeeded):
        step(env, actions)
    for each in (env, twin):
        start(each, 4)
    expected = play(twin, np.random.default_rng(1), 2)
    np.testing.assert_equal(play(env, np.random.default_rng(1), 2), expected)
