"""Run by test_lifecycles.py in a process of its own: environments come and go.

Prints a JSON object of what they leave: growth of resident memory in KiB, of open files and of threads.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import warnings
from pathlib import Path

from every_env import MAKERS, play


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
