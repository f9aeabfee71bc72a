"""Environments that come and go leave nothing behind: no memory, no open files, no threads."""

from __future__ import annotations

import pytest
from envs import MAKERS
from lifecycles import MEMORY, growth


@pytest.mark.parametrize("name", MAKERS)
def test_environments_leave_nothing_behind(name: str) -> None:
    left = growth(name, 60, 60)
    assert left["memory"] <= MEMORY
    assert (left["files"], left["threads"]) == (0, 0)
