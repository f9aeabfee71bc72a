"""Output of commands: results on stdout, notes and errors on stderr, exit codes, checks of output files.

Lines may contain strings from files: everything that a terminal would not print is escaped.
"""

import io
import json
import os
import re
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from enum import IntEnum
from pathlib import Path
from textwrap import fill
from typing import Any

import tyro

from flockesc_env.common.errors import InputError, printable
from flockesc_env.common.files import check_writable, suffix_of

_MIN_COLUMNS = 40


class Exit(IntEnum):
    """Exit code of a command; ``MEANINGS`` explains each."""

    DONE = 0
    FAILED = 1
    REFUSED = 2
    INTERRUPTED = 130
    UNREAD = 141


MEANINGS = {
    Exit.DONE: "done",
    Exit.FAILED: "jobs failed, or a replay differs from its record",
    Exit.REFUSED: "invalid option or file, output that cannot be written, or missing extra; see stderr",
    Exit.INTERRUPTED: "interrupted (Ctrl-C); finished results are kept",
    Exit.UNREAD: "the output was closed by its reader (broken pipe)",
}


def prepare_terminal() -> None:
    """Redirect closed streams to the null device; replace characters that a stream cannot encode.

    A narrower terminal counts as ``_MIN_COLUMNS`` wide, because tyro's layout never ends in 1 to 6 columns.
    With ``NO_COLOR`` tyro prints no colors. Commands write figures to files, so ``MPLBACKEND`` is dropped:
    Matplotlib does not import if it names an unknown backend.
    """
    tyro._experimental_options["ansi_codes"] = not os.environ.get("NO_COLOR")
    os.environ.pop("MPLBACKEND", None)
    if shutil.get_terminal_size().columns < _MIN_COLUMNS:
        os.environ["COLUMNS"] = str(_MIN_COLUMNS)
    sys.stdout = sys.stdout or Path(os.devnull).open("w")  # noqa: SIM115, open until exit
    sys.stderr = sys.stderr or Path(os.devnull).open("w")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def show(*lines: str) -> None:
    """Print lines of a result on stdout."""
    flush("".join(f"{printable(line)}\n" for line in lines))


def flush(text: str = "") -> None:
    """Print a text and flush stdout.

    If that fails, the output is dropped, so that the interpreter does not fail again at exit.
    """
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise OSError(error.errno, error.strerror, "output") from None


def conclude(
    result: Mapping[str, Any] | Sequence[str], output: Path | None, save: Callable[[Path], object]
) -> None:
    """Save a result, if there is an output, and show it, a JSON document or lines, even if saving fails."""
    try:
        if output is not None:
            save(output)
            note(f"saved: {output}")
    finally:
        if isinstance(result, Mapping):  # infinity and NaN become null
            finite = json.loads(json.dumps(result), parse_constant=lambda _: None)
            result = json.dumps(finite, indent=2).split("\n")
        show(*result)


def note(*lines: str) -> None:
    """Print the lines of a note on stderr, wrapped in a terminal; a closed stream is ignored."""
    text = "\n".join(["flockesc: " + printable(lines[0]), *map(printable, lines[1:])])
    with suppress(OSError):
        print(wrapped(text) if sys.stderr.isatty() else text, file=sys.stderr, flush=True)


def wrapped(text: str) -> str:
    """Return a text whose lines fit the terminal. Second lines begin below the second column of a row."""
    width, lines = shutil.get_terminal_size().columns, text.split("\n")
    for at, line in enumerate(lines):
        plain = re.sub(r"\x1b\[[\d;]*m", "", line)  # the terminal does not show codes of colors
        if len(plain) > width:
            row = re.match(r"(?: +\S+ +)?", plain)
            indent = " " * (row.end() if row else 0)
            lines[at] = fill(plain, width, subsequent_indent=indent, break_on_hyphens=False)
    return "\n".join(lines)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a text table with right-aligned columns."""
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    return ["  ".join(map(str.rjust, row, widths)) for row in (head, *rows)]


def check_output(path: Path | None, suffixes: Sequence[str] = ()) -> None:
    """Check, before a long computation, that an output, if any, has a suffix and can be written.

    Without suffixes it is a folder, which may be missing.
    """
    if path is None:
        return
    given, kind = repr(str(path)), "a file" if suffixes else "a folder"
    if suffixes and suffix_of(path) not in suffixes:
        raise InputError("output", f"a file that ends in {' or '.join(suffixes)}", given)
    if suffixes and not path.parent.is_dir():
        raise InputError("output", "a file in an existing folder", given)
    try:
        check_writable(path if suffixes else path / ".part")
    except OSError as error:
        raise InputError("output", f"{kind} that can be written ({error.strerror})", given) from None
