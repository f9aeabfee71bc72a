"""Whether code runs inside a job. Jobs use one thread and show no progress bars: many run side by side."""

from __future__ import annotations

import os
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


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Let processes that start in the block have one thread of BLAS and torch."""
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ["OMP_NUM_THREADS"] = "1"
    try:
        yield
    finally:
        os.environ.pop("OMP_NUM_THREADS")
        if before is not None:
            os.environ["OMP_NUM_THREADS"] = before
