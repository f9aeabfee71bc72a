"""Command-line applications: named commands, exit codes, errors in one line.

Commands print results with ``output.show`` or ``output.show_json`` and everything else with ``output.note``.
They raise the package's errors; ``Application.main`` turns errors into messages and exit codes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import tyro

from flockesc_env._core import __version__
from flockesc_env.cli.exits import MEANINGS, Exit
from flockesc_env.cli.output import flush, note, prepare_streams, show
from flockesc_env.common.errors import FlockescError, JobError


@dataclass(frozen=True)
class Application:
    """Commands under one program name.

    A command is a function that returns an ``Exit``. Its keyword arguments are the flags. Its docstring is
    the help; each paragraph is one line, as tyro does not wrap lines.

    Attributes:
        program: the program's name in help and errors.
        summary: first line of the program's help.
        commands: functions by the name of their command.
    """

    program: str
    summary: str
    commands: Mapping[str, Callable[..., Exit]]

    @property
    def description(self) -> str:
        """The text of ``--help``."""
        lines = [
            self.summary,
            "",
            f"{self.program} COMMAND --help explains a command, {self.program} --version names the version.",
            "",
            "Results go to stdout, notes and progress to stderr. Exit codes:",
            *(f"{code.value:>5}  {meaning}" for code, meaning in MEANINGS.items()),
        ]
        return "\n".join(lines)

    def main(self, argv: Sequence[str] | None = None) -> int:
        """Run one command and return its exit code; see ``exits``."""
        prepare_streams()
        try:
            return self._run(list(sys.argv[1:] if argv is None else argv))
        except KeyboardInterrupt as stop:
            note(": ".join(["interrupted", *map(str, stop.args)]))
            return Exit.INTERRUPTED
        except BrokenPipeError:
            return Exit.UNREAD
        except JobError as error:
            note(f"error: {error}")
            return Exit.FAILED
        except FlockescError as error:
            note(f"error: {error}")
        except OSError as error:
            note(f"error: {error.filename or 'output'}: {error.strerror or error}")
        except MemoryError as error:
            note(f"error: out of memory: {error}")
        return Exit.REFUSED

    def _run(self, argv: list[str]) -> int:
        name = argv[0] if argv else "--help"
        if name == "--version":
            show(f"flockesc {__version__}")
            return Exit.DONE
        try:
            if name in self.commands:
                return self._command(name, argv[1:])
            app = tyro.extras.SubcommandApp()
            for command, run in self.commands.items():
                app.command(name=command, help=(run.__doc__ or "").partition("\n")[0])(run)
            app.cli(prog=self.program, description=self.description, args=argv or [name])
        except SystemExit as stop:  # tyro has shown help or refused a flag
            flush()
            return stop.code if isinstance(stop.code, int) else Exit.REFUSED
        return Exit.REFUSED

    def _command(self, name: str, flags: list[str]) -> Exit:
        return tyro.cli(
            self.commands[name],
            prog=f"{self.program} {name}",
            args=flags,
            config=(tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes),
        )
