"""Hundreds of forks while threads step, start pools and sweep."""

from __future__ import annotations

from forking import forked_while

LONGEST = 5.0
"""Seconds from a fork to the child's results, with three busy threads and up to eight other children."""


def test_fork_while_all_threads_are_busy() -> None:
    found = forked_while("stepping", "starting pools", "sweeping", count=500)
    print(found)
    assert (found["children"], found["hung"], found["wrong"]) == (500, 0, 0)
    assert found["slowest"] < LONGEST
