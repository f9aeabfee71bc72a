"""How tests run ``flockesc``: in this process, or as one of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from flockesc_env import FlockScenario
from flockesc_env.cli import main

SMALL = FlockScenario(num_agents=12, num_steps=9)
SMALL_FLAGS = ["--num-agents", "12", "--num-steps", "9"]
FLOCKESC = [sys.executable, "-m", "flockesc_env"]
TIMEOUT = 60  # seconds; reached only by a command that does not end


class Ran:
    """What a command left: its code, stdout and stderr."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *argv: object) -> None:
        self.code = main([str(word) for word in argv])
        self.out, self.err = capsys.readouterr()

    def json(self) -> dict[str, Any]:
        document: dict[str, Any] = json.loads(self.out)
        return document


def run_process(*argv: object, **streams: Any) -> subprocess.CompletedProcess[str]:
    command = [*FLOCKESC, *map(str, argv)]
    return subprocess.run(command, text=True, timeout=TIMEOUT, check=False, **streams)  # noqa: S603


def sweep_flags(*more: object) -> list[object]:
    return ["sweep", "--interaction-ranges", 0, 5.5, 100, "--seeds", "3:40", *SMALL_FLAGS, *more]


def plain(boxes: str) -> str:
    """Return the text in tyro's boxes, which are of other letters where the terminal has no Unicode."""
    return "\n".join(line.strip("│|").strip() for line in boxes.splitlines())
