"""Hundreds of forks while threads are busy, and ten thousand lifecycles of every environment."""

from __future__ import annotations

import pytest
from envs import ADAPTERS
from forking import forked_while
from lifecycles import growth, left_behind

LONGEST = 5.0
"""Seconds from a fork to the child's results, with three busy threads and up to eight other children."""


def test_fork_while_all_threads_are_busy() -> None:
    found = forked_while("stepping", "starting pools", "sweeping", count=500)
    print(found)
    assert (found["children"], found["hung"], found["wrong"]) == (500, 0, 0)
    assert found["slowest"] < LONGEST


@pytest.mark.parametrize("name", ADAPTERS)
def test_10_000_environments_leave_nothing_behind(name: str) -> None:
    left = growth([name], 3_000, 10_000)
    print(left)
    assert not left_behind(left)
