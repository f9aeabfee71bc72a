"""Stored snapshots restore, continue with known bits, and are still written byte for byte."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import pytest
from golden_states import MAKERS, followed, written

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "states.json").read_text())


@pytest.mark.parametrize("name", MAKERS)
def test_a_stored_state_continues(name: str) -> None:
    """After a change of the layout, raise the version of snapshots and run ``golden_states.py``."""
    state = base64.b64decode(GOLDEN[name]["state"])
    assert followed(name, state) == GOLDEN[name]["followed"]
    assert written(name) == state
