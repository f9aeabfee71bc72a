"""Environments that come and go leave nothing behind: no memory, no open files, no threads."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from every_env import MAKERS

SCRIPT = Path(__file__).with_name("lifecycles.py")
MEMORY = 1024
"""KiB by which the allocator may still grow after the warm-up."""


def growth(name: str, warm_up: int, count: int) -> dict[str, int]:
    """Return what ``count`` environments leave after the first ``warm_up``, as the allocator grows."""
    command = [sys.executable, str(SCRIPT), name, str(warm_up), str(count)]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    found: dict[str, int] = json.loads(ended.stdout.splitlines()[-1])
    return found


@pytest.mark.parametrize("name", MAKERS)
def test_environments_leave_nothing_behind(name: str) -> None:
    left = growth(name, 60, 60)
    assert left["memory"] <= MEMORY
    assert (left["files"], left["threads"]) == (0, 0)
