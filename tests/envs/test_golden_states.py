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
from option_table import EVERY_STEP, RANDOM, UNLIKE, small_flock

import flockesc_env as fe

FILE = Path(__file__).parents[1] / "golden" / "states.json"

MAKERS: dict[str, Callable[[], Any]] = {
    "flock": lambda: fe.FlockEscapeEnv(
        small_flock(**UNLIKE, predators=RANDOM, capture_radius=1.0), action_mode="range", **EVERY_STEP
    ),
    "line": lambda: fe.LineEscapeEnv(
        fe.LineScenario(num_agents=9, escape_force="linear_as_printed"), action_mode="range"
    ),
}


def steps(env: Any, start: Any) -> list[Any]:
    return [start, *(env.step(np.array([0.25 * (1 + number)], np.float32)) for number in range(2))]


def document(name: str, state: bytes | None = None) -> dict[str, str]:
    """Return a snapshot after 2 steps, and the hash of what follows a stored one, by default the same.

    It is restored, and 2 steps, a reset without a seed and 2 steps follow.
    """
    env = MAKERS[name]()
    steps(env, env.reset(seed=7))
    written = env.get_state()
    restored, digest = MAKERS[name](), hashlib.sha256()
    feed(digest, steps(restored, restored.set_state(state or written)))
    feed(digest, steps(restored, restored.reset()))
    return {"state": base64.b64encode(written).decode(), "followed": digest.hexdigest()}


@pytest.mark.parametrize("name", MAKERS)
def test_a_stored_state_continues(name: str) -> None:
    golden = json.loads(FILE.read_text())[name]
    assert document(name, base64.b64decode(golden["state"])) == golden


if __name__ == "__main__":
    FILE.write_text(json.dumps({name: document(name) for name in MAKERS}, indent=4) + "\n")
