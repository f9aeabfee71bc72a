"""Hundreds of forks while every kind of thread is busy at once."""

from __future__ import annotations

from test_processes import forked_while


def test_fork_while_all_threads_are_busy() -> None:
    found = forked_while("stepping", "starting pools", "sweeping", count=500)
    print(found)
    assert found == {"children": 500, "hung": 0, "wrong": 0}
