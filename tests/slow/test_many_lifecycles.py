"""10,000 environments of each adapter leave no more memory, files or threads behind than a few."""

from __future__ import annotations

import pytest
from envs import ADAPTERS
from lifecycles import growth, left_behind


@pytest.mark.parametrize("name", ADAPTERS)
def test_10_000_environments_leave_nothing_behind(name: str) -> None:
    left = growth([name], 3_000, 10_000)
    print(left)
    assert not left_behind(left)
