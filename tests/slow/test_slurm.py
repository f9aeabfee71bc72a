"""Array tasks that a time limit or a preemption interrupts, or that die, on submitit's local executor."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path

import pytest
from backends import calls, contents, note_calls

from flockesc_env.common.errors import JobError
from flockesc_env.jobs import Cache, Job, find_backend, run


@pytest.fixture(autouse=True)
def noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return note_calls(tmp_path, monkeypatch)


def test_an_interrupted_task_is_requeued_and_continues(tmp_path: Path, noted: Path) -> None:
    """A time limit and a preemption reach the process of a task as this signal."""

    def interrupt() -> None:
        while len(contents(tmp_path / "cache")) < 2:
            time.sleep(0.01)
        [task, *_] = {int(path.name.split("-")[1]) for path in noted.iterdir()}
        os.kill(task, signal.SIGUSR2)

    threading.Thread(target=interrupt).start()
    jobs = [Job("backends:slow_square", (number,)) for number in range(6)]
    run(jobs, Cache(tmp_path / "cache"), find_backend("slurm:cluster=local"))
    log = "".join(path.read_text() for path in (tmp_path / "cache" / "slurm").glob("*_log.out"))
    assert "Requeued job" in log
    assert calls(noted) - len(jobs) == 1  # the one that was interrupted
    run(jobs, Cache(tmp_path / "serial"), find_backend("serial"))
    assert contents(tmp_path / "cache") == contents(tmp_path / "serial")


def test_a_job_that_always_kills_its_worker_fails_alone(tmp_path: Path) -> None:
    jobs = [Job("backends:dies", (number,)) for number in range(6)]
    with pytest.raises(JobError, match=r"1 of 6 jobs failed[^:]*\nbackends:dies\(1,\)"):
        run(jobs, Cache(tmp_path / "cache"), find_backend("slurm:cluster=local"))
    assert len(contents(tmp_path / "cache")) == 5
