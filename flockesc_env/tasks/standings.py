"""The present best of every task, as a file in the package; docs/scoreboard.md has all results."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

import msgspec

from flockesc_env.common.files import write_text

_NAME = "standings.json"


class Standing(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The best submission of a task: its name, its kind and its mean score."""

    learner: str
    kind: str
    score: float


def standings() -> dict[str, Standing]:
    """Return the present best of every task."""
    text = files(__package__).joinpath(_NAME).read_bytes()
    return msgspec.json.decode(text, type=dict[str, Standing])


def write_standings(found: Mapping[str, Standing]) -> None:
    """Replace the file in this checkout."""
    text = msgspec.json.format(msgspec.json.encode(dict(found)), indent=1).decode()
    write_text(Path(__file__).with_name(_NAME), text + "\n")
