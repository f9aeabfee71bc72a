"""Hundreds of forks while threads are busy, and ten thousand lifecycles of every environment."""

from __future__ import annotations

import sys

import pytest
from envs import ADAPTERS
from forking import forked_while
from lifecycles import growth, left_behind


def test_fork_while_all_threads_are_busy() -> None:
    found = forked_while("stepping", "starting pools", "sweeping", count=500)
    assert found == {"children": 500, "hung": 0, "wrong": 0}


@pytest.mark.skipif(sys.platform != "linux", reason="memory, files and threads are counted in Linux's /proc")
@pytest.mark.parametrize("name", ADAPTERS)
def test_10_000_environments_leave_nothing_behind(name: str) -> None:
    left = growth([name], 3_000, 10_000)
    print(left)
    assert not left_behind(left)
