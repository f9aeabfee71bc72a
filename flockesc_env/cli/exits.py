"""Exit codes: what scripts can rely on."""

from __future__ import annotations

from enum import IntEnum


class Exit(IntEnum):
    """How a command ended."""

    DONE = 0
    FAILED = 1
    REFUSED = 2
    INTERRUPTED = 130
    UNREAD = 141


MEANINGS = {
    Exit.DONE: "done",
    Exit.FAILED: "jobs failed, or a replay differs from its record",
    Exit.REFUSED: "an option, a file or a missing extra was refused; stderr says which",
    Exit.INTERRUPTED: "interrupted (Ctrl-C); what was finished is kept",
    Exit.UNREAD: "the reader of the output has gone (broken pipe)",
}
