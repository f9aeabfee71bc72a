"""``Application``: a command-line program with commands, exit codes and one-line errors.

Commands print results with ``output.show`` or ``output.conclude``, and notes with ``output.note``. They
raise the package's errors; ``Application.main`` converts them to messages and exit codes.
"""

import os
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from typing import Any

import tyro

from flockesc_env._core import __version__
from flockesc_env.cli.flags import NUMBERS, similar_field
from flockesc_env.cli.output import MEANINGS, Exit, flush, note, prepare_terminal, show, wrapped
from flockesc_env.common.checks import as_choice
from flockesc_env.common.errors import FlockescError, JobError, printable

_HELP = {"-h", "--help"}


@dataclass(frozen=True)
class Application:
    """A command-line program.

    A command is a function that returns an ``Exit``. Its keyword arguments are the flags, its docstring is
    the help text.
    """

    program: str  # its name in help texts
    summary: str  # a sentence
    commands: Mapping[str, Callable[..., Exit]]

    def main(self, argv: Sequence[str] | None = None) -> int:
        """Run a command with ``argv`` or, if it is None, ``sys.argv[1:]``; return its exit code."""
        prepare_terminal()
        if os.getpid() == 1:  # of a container: the system ignores the signal without a handler
            signal.signal(signal.SIGTERM, lambda number, _: os._exit(128 + number))
        try:
            return self._run(list(sys.argv[1:] if argv is None else argv))
        except KeyboardInterrupt as stop:
            note(": ".join(["interrupted", *map(str, stop.args)]))
            return Exit.INTERRUPTED
        except BrokenPipeError:
            return Exit.UNREAD
        except FlockescError as error:
            note(*f"error: {error}".split("\n"))  # the failures of jobs have tracebacks
            if isinstance(error, JobError):
                return Exit.FAILED
        except OSError as error:
            note(": ".join(["error", *filter(None, [error.filename]), error.strerror or str(error)]))
        except MemoryError as error:
            note(f"error: out of memory: {error}")
        return Exit.REFUSED

    def _run(self, argv: list[str]) -> Exit | int:
        name, *flags = argv or ["--help"]
        if name == "--version":
            show(f"flockesc {__version__}")
            return Exit.DONE
        stdout: Any = sys.stdout if _HELP.isdisjoint([name, *flags]) else _Wrapped(sys.stdout)
        try:
            with redirect_stdout(stdout):
                if name in _HELP:
                    show(*self._overview())
                    return Exit.DONE
                return tyro.cli(
                    self.commands[as_choice(name, "command", self.commands)],
                    prog=f"{self.program} {name}",
                    args=list(map(_printable_name, flags)),
                    config=(tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes),
                    registry=NUMBERS,
                )
        except SystemExit as stop:  # from tyro, after --help or an invalid flag
            flush()
            # tyro suggests similar flags, but not fields.
            if stop.code and (field := similar_field(flags, self.commands[name])):
                note(f"{field} is a field of the scenario; set it with --set {field}=VALUE")
            return stop.code if isinstance(stop.code, int) else Exit.REFUSED

    def _overview(self) -> list[str]:
        """Return the lines of the help that lists all commands."""
        width, program = max(map(len, self.commands)), self.program
        explained = {name: (run.__doc__ or "").partition("\n")[0] for name, run in self.commands.items()}
        return [
            f"usage: {program} COMMAND ..",
            "",
            self.summary,
            "",
            *(f"  {name:<{width}}  {text}" for name, text in explained.items()),
            "",
            f"{program} COMMAND --help explains a command; {program} --version prints the version.",
            "",
            "Results are printed on stdout, notes and progress on stderr. Exit codes:",
            *(f"{code.value:>5}  {meaning}" for code, meaning in MEANINGS.items()),
        ]


class _Wrapped:
    """A stream that wraps lines at the terminal's width: tyro wraps only those in boxes."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        written: int = self._stream.write(wrapped(text))
        return written


def _printable_name(word: str) -> str:
    """Escape the name of a flag: tyro prints unknown ones. A pattern of files may match a file "--..."."""
    name, equals, value = word.partition("=")
    return printable(name) + equals + value if word.startswith("-") else word
