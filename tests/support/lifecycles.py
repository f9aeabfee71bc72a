"""Creates and closes environments in a separate process and measures what they leave behind.

The process prints a JSON object: growth of resident memory in KiB, of open files and of threads.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

from envs import MAKERS, play

MEMORY = 1024
"""KiB by which the allocator may still grow after the warm-up."""


def growth(name: str, warm_up: int, count: int) -> dict[str, int]:
    """Return what ``count`` environments leave after the first ``warm_up``, as the allocator grows."""
    command = [sys.executable, __file__, name, str(warm_up), str(count)]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    found: dict[str, int] = json.loads(ended.stdout.splitlines()[-1])
    return found


def resources() -> dict[str, int]:
    """Return what this process holds."""
    gc.collect()
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return {
        "memory": int(status["VmRSS"].split()[0]),
        "files": len(os.listdir("/proc/self/fd")),  # noqa: PTH208, one system call
        "threads": int(status["Threads"]),
    }


def cycle(name: str, count: int) -> None:
    """Create, play and close an environment this often."""
    for seed in range(count):
        env = MAKERS[name]()
        play(env, 2, seed)
        env.close()


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    name, warm_up, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    cycle(name, warm_up)
    before = resources()
    cycle(name, count)
    after = resources()
    print(json.dumps({key: after[key] - before[key] for key in before}))
