"""A killed reproduction of the paper continues from its finished jobs and ends with the same bytes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from studies.paper.page import RESULTS_FILE

SCRIPT = """
import sys
from pathlib import Path
from studies.paper.plan import Trials
from studies.paper.reproduction import reproduce
from flockesc_env.jobs.serial import serial
def told(jobs, cache):
    for outcome in serial(jobs, cache):
        print("job", flush=True)
        yield outcome
reproduce(Path(sys.argv[1]), Trials(flocks=4, lines=40), told)
"""


def files_in(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def test_a_killed_run_continues_and_ends_with_equal_bytes(tmp_path: Path) -> None:
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    command = [sys.executable, "-c", SCRIPT]
    environment = {**os.environ, "PYTHONHASHSEED": "1"}
    with subprocess.Popen([*command, str(killed)], stdout=subprocess.PIPE, text=True) as process:  # noqa: S603
        assert process.stdout is not None
        for _ in range(15):
            process.stdout.readline()
        process.send_signal(signal.SIGKILL)
    finished = set((killed / "cache").glob("*.npz"))
    stamps = {path: path.stat().st_mtime_ns for path in finished}
    assert finished
    assert not (killed / RESULTS_FILE).exists()
    time.sleep(0.01)  # later files have later stamps
    for folder in (killed, whole):
        subprocess.run(  # noqa: S603
            [*command, str(folder)], check=True, stdout=subprocess.DEVNULL, env=environment
        )
    assert {path: path.stat().st_mtime_ns for path in finished} == stamps
    assert files_in(whole) == files_in(killed)
