"""Whether code runs inside a job. Jobs use one thread and show no progress bars: many run side by side."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_IN_JOB = ContextVar("in_job", default=False)


def is_in_job() -> bool:
    """Return whether the caller runs inside a job."""
    return _IN_JOB.get()


@contextmanager
def in_job() -> Iterator[None]:
    """Mark the code in the block as a job."""
    token = _IN_JOB.set(True)
    try:
        yield
    finally:
        _IN_JOB.reset(token)
