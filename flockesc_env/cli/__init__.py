"""The command-line program ``flockesc``; every command is a module of this package.

Commands import heavy optional libraries inside functions, after ``require`` has checked them, so that
``flockesc`` starts fast.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flockesc_env.cli import benchmark, episodes, presets, replay, simulate, sweep, watch
from flockesc_env.cli.application import Application
from flockesc_env.cli.exits import Exit

BENCHMARK = Application(
    "flockesc benchmark",
    "Score policies on frozen tasks, verify the scores of others, and record episodes.",
    {
        "tasks": benchmark.tasks,
        "score": benchmark.score,
        "verify": benchmark.verify,
        "report": benchmark.report,
        "episodes": episodes.run,
    },
    default="tasks",
)

COMMANDS: dict[str, Callable[..., Exit] | Application] = {
    "simulate": simulate.run,
    "sweep": sweep.run,
    "presets": presets.run,
    "watch": watch.run,
    "replay": replay.run,
    "benchmark": BENCHMARK,
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command of ``flockesc`` and return its exit code; see ``Application.main``."""
    summary = "A flock under attack: how far should its agents listen?"
    return Application("flockesc", summary, COMMANDS).main(argv)
