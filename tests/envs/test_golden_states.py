"""Stored snapshots restore, continue with known bits, and are still written byte for byte.

``python tests/envs/test_golden_states.py`` rewrites ``tests/golden/states.json`` after an intended change of
the layout of snapshots, which also increases their version, or of the names of options.
"""

import base64
import hashlib
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "support"))  # this file is also a program
from golden_episodes import feed
from option_table import EVERY_STEP, UNLIKE, small_flock

import flockesc_env as fe
from flockesc_env.scenario import PurePursuit, Wandering

FILE = Path(__file__).parents[1] / "golden" / "states.json"
HUNTERS = (
    Wandering((10.0, 10.0), (5.0, 0.0), angular_diffusion=2.0),
    PurePursuit((30.0, 0.0), (0.0, 9.0), confusion_rate=2.0),
)

MAKERS: dict[str, Callable[[], Any]] = {
    "flock": lambda: fe.FlockEscapeEnv(
        small_flock(**UNLIKE, predators=HUNTERS, capture_radius=1.0), action_mode="range", **EVERY_STEP
    ),
    "line": lambda: fe.LineEscapeEnv(
        fe.LineScenario(num_agents=9, escape_force="linear_as_printed"), action_mode="range"
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


@pytest.mark.parametrize("name", MAKERS)
def test_a_stored_state_continues(name: str) -> None:
    golden = json.loads(FILE.read_text())[name]
    state = base64.b64decode(golden["state"])
    assert followed(name, state) == golden["followed"]
    assert written(name) == state


if __name__ == "__main__":
    states = {name: written(name) for name in MAKERS}
    documents = {
        name: {"state": base64.b64encode(state).decode(), "followed": followed(name, state)}
        for name, state in states.items()
    }
    FILE.write_text(json.dumps(documents, indent=4) + "\n")
