"""Snapshots of one flock and one line, and hashes of the steps that follow.

``python tests/support/golden_states.py > tests/golden/states.json`` rewrites them after an intended change of
the layout of snapshots, which also increases their version.
"""

from __future__ import annotations

import base64
import hashlib
import json
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from golden_episodes import feed
from option_table import UNLIKE, small_flock

from flockesc_env import FlockEscapeEnv, LineEscapeEnv, LineScenario, PurePursuit, Wandering

HUNTERS = (
    Wandering((10.0, 10.0), (5.0, 0.0), angular_diffusion=2.0),
    PurePursuit((30.0, 0.0), (0.0, 9.0), confusion_rate=2.0),
)

MAKERS: dict[str, Callable[[], Any]] = {
    "flock": lambda: FlockEscapeEnv(
        small_flock(**UNLIKE, predators=HUNTERS, capture_radius=1.0), action_mode="range"
    ),
    "line": lambda: LineEscapeEnv(
        LineScenario(num_agents=9, escape_force="linear_as_printed"), action_mode="range"
    ),
}


def step(env: Any, number: int) -> Any:
    return env.step(np.array([0.25 * (1 + number % 2)], np.float32))


def followed(name: str, state: bytes) -> str:
    """Return the hash of the restored observation, 2 steps, a reset without a seed, and 2 steps."""
    env = MAKERS[name]()
    digest = hashlib.sha256()
    feed(digest, env.set_state(state))
    for number in range(2):
        feed(digest, step(env, number))
    feed(digest, env.reset())
    for number in range(2):
        feed(digest, step(env, number))
    return digest.hexdigest()


def written(name: str) -> bytes:
    """Return the snapshot after 2 steps."""
    env = MAKERS[name]()
    env.reset(seed=7)
    for number in range(2):
        step(env, number)
    state: bytes = env.get_state()
    return state


if __name__ == "__main__":
    states = {name: written(name) for name in MAKERS}
    json.dump(
        {
            name: {"state": base64.b64encode(state).decode(), "followed": followed(name, state)}
            for name, state in states.items()
        },
        sys.stdout,
        indent=4,
    )
    print()
