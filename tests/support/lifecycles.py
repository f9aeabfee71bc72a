"""Creates and closes environments in a separate process and measures the growth of its resources.

The process prints a JSON object: for each adapter the growth of resident memory in KiB, of open files and of
threads.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from envs import ADAPTERS, play, start

MEMORY = 1024
"""KiB by which the allocator may still grow after the warm-up."""


def growth(names: Iterable[str], warm_up: int, count: int) -> dict[str, dict[str, int]]:
    """Return the growth of resources by ``count`` environments of each adapter after ``warm_up`` others."""
    command = [sys.executable, __file__, str(warm_up), str(count), *names]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    found: dict[str, dict[str, int]] = json.loads(ended.stdout.splitlines()[-1])
    return found


def left_behind(left: dict[str, dict[str, int]]) -> dict[str, dict[str, int]]:
    """Return the adapters that left memory, files or threads behind."""
    return {
        name: kept
        for name, kept in left.items()
        if kept["memory"] > MEMORY or (kept["files"], kept["threads"]) != (0, 0)
    }


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


def grown(name: str, warm_up: int, count: int) -> dict[str, int]:
    """Return the growth of resources by environments of one adapter in this process."""
    cycle(name, warm_up)
    before = resources()
    cycle(name, count)
    after = resources()
    return {key: after[key] - before[key] for key in before}


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    warm_up, count = int(sys.argv[1]), int(sys.argv[2])
    print(json.dumps({name: grown(name, warm_up, count) for name in sys.argv[3:]}))
