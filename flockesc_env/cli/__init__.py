"""The command line: ``flockesc simulate | sweep | presets | paper | worlds | watch | replay | bench``.

A command is a file of this folder with a function ``run``: its keyword arguments are the flags, its docstring
is the help (paragraphs of one line, as tyro does not wrap them), and it returns an ``Exit``. An entry of
``COMMANDS`` adds it. What it needs beyond the package's own dependencies it imports inside of functions, once
``output.require`` has looked for it.

Commands print results with ``output.show`` or ``output.show_json`` and everything else with ``output.note``.
They raise what the package raises; ``main`` makes messages and exit codes of it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

import tyro

from flockesc_env import __version__
from flockesc_env.cli import bench, paper, presets, replay, simulate, sweep, watch, worlds
from flockesc_env.cli.exits import MEANINGS, Exit
from flockesc_env.cli.flags import registry
from flockesc_env.cli.output import flush, note, prepare_streams, show
from flockesc_env.common.errors import FlockescError

COMMANDS: dict[str, Callable[..., Exit]] = {
    "simulate": simulate.run,
    "sweep": sweep.run,
    "presets": presets.run,
    "paper": paper.run,
    "worlds": worlds.run,
    "watch": watch.run,
    "replay": replay.run,
    "bench": bench.run,
}

_DESCRIPTION = "\n".join(
    [
        "A flock under attack: how far should its agents listen?",
        "",
        "flockesc COMMAND --help explains a command, flockesc --version names the version.",
        "",
        "Results go to stdout, notes and progress to stderr. Exit codes:",
        *(f"{code.value:>5}  {meaning}" for code, meaning in MEANINGS.items()),
    ]
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; see ``exits``."""
    prepare_streams()
    try:
        return _run(list(sys.argv[1:] if argv is None else argv))
    except KeyboardInterrupt:
        note("interrupted")
        return Exit.INTERRUPTED
    except BrokenPipeError:
        return Exit.UNREAD
    except FlockescError as error:
        note(f"error: {error}")
    except OSError as error:
        note(f"error: {error.filename or 'output'}: {error.strerror or error}")
    except MemoryError as error:
        note(f"error: out of memory: {error}")
    return Exit.REFUSED


def _run(argv: list[str]) -> int:
    name = argv[0] if argv else "--help"
    if name == "--version":
        show(f"flockesc {__version__}")
        return Exit.DONE
    try:
        if name in COMMANDS:
            return _command(name, argv[1:])
        app = tyro.extras.SubcommandApp()
        for command, run in COMMANDS.items():
            app.command(name=command, help=(run.__doc__ or "").partition("\n")[0])(run)
        app.cli(prog="flockesc", description=_DESCRIPTION, args=argv or [name], registry=registry([]))
    except SystemExit as stop:  # tyro has shown help or refused a flag
        flush()
        return stop.code if isinstance(stop.code, int) else Exit.REFUSED
    return Exit.REFUSED


def _command(name: str, flags: list[str]) -> Exit:
    return tyro.cli(
        COMMANDS[name],
        prog=f"flockesc {name}",
        args=flags,
        registry=registry(flags),
        config=(tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes),
    )
