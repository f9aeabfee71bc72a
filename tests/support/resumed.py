"""Restores a flock in a child process, which imports only this module."""

from typing import Any

import numpy as np
from option_table import EVERY_STEP, UNLIKE, small_flock

from flockesc_env import FlockEscapeEnv


def make() -> FlockEscapeEnv:
    return FlockEscapeEnv(small_flock(**UNLIKE), num_threads=2, **EVERY_STEP)


def steps(env: FlockEscapeEnv) -> list[Any]:
    """Return the results of 8 steps, across the end of the episode and a reset."""
    return [
        env.reset() if number == 5 else env.step(np.array([0.1 * number], np.float32)) for number in range(8)
    ]


def go_on(state: bytes, sender: Any) -> None:
    """Restore a snapshot and send the results of the next steps."""
    env = make()
    env.set_state(state)
    sender.send(steps(env))
