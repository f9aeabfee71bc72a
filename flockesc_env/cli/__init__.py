"""The command-line program ``flockesc``; every command is a function of a module of this package.

Commands import heavy optional libraries inside functions, after ``require`` has checked them, so that
``flockesc`` starts fast.
"""

from collections.abc import Callable, Sequence

from flockesc_env.cli import runs, scan, sweep, tasks
from flockesc_env.cli.application import Application
from flockesc_env.cli.output import Exit

COMMANDS: dict[str, Callable[..., Exit]] = {
    "simulate": runs.simulate,
    "sweep": sweep.run,
    "scan": scan.run,
    "presets": runs.presets,
    "watch": runs.watch,
    "replay": runs.replay,
    "tasks": tasks.run,
    "compare": tasks.compare,
    "score": tasks.score,
    "verify": tasks.verify,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command of ``flockesc`` and return its exit code; see ``Application.main``."""
    summary = "A flock under attack: how far should its agents listen?"
    return Application("flockesc", summary, COMMANDS).main(argv)
