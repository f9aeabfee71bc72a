"""The command-line program ``flockesc``; every command is a module of this package.

Commands import heavy optional libraries inside functions, after ``require`` has checked them, so that
``flockesc`` starts fast.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flockesc_env.cli import episodes, presets, replay, simulate, sweep, tasks, watch
from flockesc_env.cli.application import Application
from flockesc_env.cli.exits import Exit

COMMANDS: dict[str, Callable[..., Exit]] = {
    "simulate": simulate.run,
    "sweep": sweep.run,
    "presets": presets.run,
    "watch": watch.run,
    "replay": replay.run,
    "tasks": tasks.run,
    "compare": tasks.compare,
    "score": tasks.score,
    "verify": tasks.verify,
    "report": tasks.report,
    "episodes": episodes.run,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command of ``flockesc`` and return its exit code; see ``Application.main``."""
    summary = "A flock under attack: how far should its agents listen?"
    return Application("flockesc", summary, COMMANDS).main(argv)
