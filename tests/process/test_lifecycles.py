"""Environments that come and go leave nothing behind: no memory, no open files, no threads."""

from __future__ import annotations

from envs import ADAPTERS
from lifecycles import growth, left_behind


def test_environments_leave_nothing_behind() -> None:
    assert not left_behind(growth(ADAPTERS, 40, 40))
