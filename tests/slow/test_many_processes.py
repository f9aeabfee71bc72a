"""Hundreds of forks while threads are busy, and ten thousand lifecycles of every environment."""

import gc
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "support"))  # this file is also a program
from envs import ADAPTERS, play, start
from forking import forked_while

MEMORY = 1024
"""KiB by which the allocator may still grow after the warm-up."""


def test_fork_while_all_threads_are_busy() -> None:
    found = forked_while("step_for_ever", "start_pools", "sweep_for_ever", count=500)
    assert found == {"children": 500, "hung": 0, "wrong": 0}


@pytest.mark.skipif(sys.platform != "linux", reason="memory, files and threads are counted in Linux's /proc")
@pytest.mark.parametrize("name", ADAPTERS)
def test_10_000_environments_leave_nothing_behind(name: str) -> None:
    """In a process that prints the growth of its resources after a warm-up."""
    command = [sys.executable, __file__, name, "3000", "10000"]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    left = json.loads(ended.stdout.splitlines()[-1])
    print(left)
    assert left["memory"] <= MEMORY
    assert (left["files"], left["threads"]) == (0, 0)


def resources() -> dict[str, int]:
    """Return the memory, open files and threads of this process."""
    gc.collect()
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return {
        "memory": int(status["VmRSS"].split()[0]),
        "files": len(os.listdir("/proc/self/fd")),  # noqa: PTH208, one system call
        "threads": int(status["Threads"]),
    }


def cycle(name: str, count: int) -> None:
    """Create, play and close an environment ``count`` times."""
    for seed in range(count):
        env = ADAPTERS[name].make()
        start(env, seed)
        play(env, np.random.default_rng(seed), 2)
        env.close()


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    name, warm_up, count = sys.argv[1], *map(int, sys.argv[2:])
    cycle(name, warm_up)
    before = resources()
    cycle(name, count)
    print(json.dumps({key: value - before[key] for key, value in resources().items()}))
