"""Runs that are killed are continued: a search ends with the bits of an uninterrupted one."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flockesc_env import load_policy

SUPPORT = Path(__file__).parents[1] / "support"
CHILD = """
import sys
sys.path.insert(0, sys.argv[1])
from pathlib import Path
from small_runs import small_run
from training.train import train
length = {"generations": 40} if sys.argv[2] == "search" else {"samples": 20_000, "num_evaluations": 20}
train(small_run(Path(sys.argv[3]), sys.argv[2], **length), resume=True)
"""


@pytest.mark.parametrize("algorithm", ["search", "PPO", "SAC"])
def test_a_killed_run_is_continued(algorithm: str, tmp_path: Path) -> None:
    def started(folder: str) -> subprocess.Popen[bytes]:
        words = [sys.executable, "-c", CHILD, str(SUPPORT), algorithm, str(tmp_path / folder)]
        return subprocess.Popen(words)  # noqa: S603

    killed = started("killed")
    while not [*(tmp_path / "killed").glob("checkpoint*/*.zip"), *(tmp_path / "killed").glob("*.pickle")]:
        assert killed.poll() is None
        time.sleep(0.01)
    killed.kill()
    killed.wait()
    assert not (tmp_path / "killed" / "run.json").exists()
    for folder in ("killed", "whole"):
        assert started(folder).wait() == 0
    one, other = (json.loads((tmp_path / name / "run.json").read_text()) for name in ("killed", "whole"))
    assert one["samples"] == other["samples"]
    if algorithm == "search":
        assert one["curve"] == other["curve"]
        policies = [load_policy(tmp_path / name / "policy.npz").policy for name in ("killed", "whole")]
        assert policies[0].parameters.tobytes() == policies[1].parameters.tobytes()
