"""Exit codes of the command-line program."""

from __future__ import annotations

from enum import IntEnum


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
