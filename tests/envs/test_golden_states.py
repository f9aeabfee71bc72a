"""States that were written once restore, go on to known bits, and are still written in the same way."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import pytest
from golden_states import MAKERS, followed, written

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "states.json").read_text())


@pytest.mark.parametrize("name", MAKERS)
def test_a_stored_state_goes_on(name: str) -> None:
    """A change of the layout raises the version of states; then rewrite the file (see ``golden_states``)."""
    state = base64.b64decode(GOLDEN[name]["state"])
    assert followed(name, state) == GOLDEN[name]["followed"]
    assert written(name) == state
