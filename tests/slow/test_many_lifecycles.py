"""10,000 environments of every kind leave no more behind than a few do."""

from __future__ import annotations

import pytest
from envs import MAKERS
from lifecycles import MEMORY, growth


@pytest.mark.parametrize("name", MAKERS)
def test_10_000_environments_leave_nothing_behind(name: str) -> None:
    left = growth(name, 3_000, 10_000)
    print(name, left)
    assert left["memory"] <= MEMORY
    assert (left["files"], left["threads"]) == (0, 0)
