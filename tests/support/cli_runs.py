"""Run ``flockesc`` and ``python -m studies`` in this process or in a new one."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flockesc_env import FlockScenario, LineScenario, save_policy
from flockesc_env.cli import main
from flockesc_env.policies.network import Architecture, NetworkPolicy

SMALL = FlockScenario(num_agents=12, num_steps=9)
SMALL_FLAGS = ["--set", "num_agents=12", "--set", "num_steps=9"]
FLOCKESC = [sys.executable, "-m", "flockesc_env"]
TIMEOUT = 60  # seconds; reached only by a command that hangs


class Ran:
    """The exit code, stdout and stderr of a command."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *argv: object, run: Any = main) -> None:
        self.code = run([str(word) for word in argv])
        self.out, self.err = capsys.readouterr()

    def json(self) -> dict[str, Any]:
        return json.loads(self.out)


Cli = Callable[..., Ran]
"""The fixture ``cli`` of conftest.py: a function of the words of a command."""


def run_process(*argv: object, **streams: Any) -> subprocess.CompletedProcess[str]:
    command = [*FLOCKESC, *map(str, argv)]
    return subprocess.run(command, text=True, timeout=TIMEOUT, check=False, **streams)  # noqa: S603


@contextmanager
def small_files(size: int) -> Iterator[None]:
    """Let writing fail after some bytes, as on a full disk."""
    resource = pytest.importorskip("resource", reason="limits on files need a POSIX system")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def npz(**arrays: Any) -> bytes:
    """Return the bytes of a file of arrays."""
    np.savez(packed := BytesIO(), **arrays)
    return packed.getvalue()


def policy_file(path: Path, scenario: FlockScenario | LineScenario = SMALL) -> Path:
    """Write a network whose ranges depend on the observation, under the name of a built-in policy."""
    is_line = isinstance(scenario, LineScenario)
    architecture = Architecture(("offset_0" if is_line else "predator_distance", "time"), (3,), memory=1)
    policy = NetworkPolicy(architecture, np.random.default_rng(0).normal(size=architecture.size))
    options: Any = {} if is_line else {"max_range": 20.0, "steps_per_action": 4}
    save_policy(policy.with_options(name="random", per_agent=not is_line, scenario=scenario, **options), path)
    return path


def sweep_flags(*more: object) -> list[object]:
    return ["sweep", "--interaction-ranges", 0, 5.5, 100, "--seeds", "3:40", *SMALL_FLAGS, *more]


def plain(boxes: str) -> str:
    return "\n".join(line.strip("│|").strip() for line in boxes.splitlines())
