"""The command line ``flockesc``: one command per file of this folder, listed in ``COMMANDS``.

A command imports heavy libraries inside functions, after ``require`` has found them installed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flockesc_env.cli import presets, replay, simulate, sweep, watch
from flockesc_env.cli.application import Application
from flockesc_env.cli.exits import Exit

COMMANDS: dict[str, Callable[..., Exit]] = {
    "simulate": simulate.run,
    "sweep": sweep.run,
    "presets": presets.run,
    "watch": watch.run,
    "replay": replay.run,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command of ``flockesc`` and return its exit code."""
    summary = "A flock under attack: how far should its agents listen?"
    return Application("flockesc", summary, COMMANDS).main(argv)
