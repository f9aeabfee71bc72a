"""The back end ``slurm``: what is asked of SLURM; tests/slow/test_slurm.py interrupts its tasks."""

from __future__ import annotations

import re
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from backends import contents, note_calls

from flockesc_env.common.errors import ArgumentError
from flockesc_env.jobs import Cache, Job, find_backend, run

pytest.importorskip("submitit", reason="no submitit (extra slurm)")
from submitit.core import submission
from submitit.slurm.test_slurm import mocked_slurm

from flockesc_env.jobs import slurm

JOBS = [Job("backends:square", (number,)) for number in range(30)]


@pytest.fixture(autouse=True)
def noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return note_calls(tmp_path, monkeypatch)


def test_what_slurm_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Array tasks of one core; the mocked cluster runs them in this process."""
    monkeypatch.setattr(slurm, "CHUNK_SECONDS", 10.0)
    backend = find_backend("slurm:partition=short,time=30,account=flocks,array_parallelism=2")
    with mocked_slurm() as mock:

        def work() -> None:
            folder = tmp_path / "slurm"
            for number in range(3):
                while not (folder / f"12_{number}_submitted.pkl").exists():
                    time.sleep(0.01)
            for number in range(3):
                with mock.job_context(f"12_{number}"):
                    submission.process_job(folder)

        monkeypatch.setattr(slurm, "time", SimpleNamespace(sleep=lambda _: work()))
        run(JOBS, Cache(tmp_path), backend)
    text = (tmp_path / "slurm" / "12_submission.sh").read_text()
    for line in (
        "--partition=short",
        "--time=30",
        "--account=flocks",
        "--array=0-2%2",
        "--cpus-per-task=1",
        "--job-name=flockesc",
    ):
        assert f"#SBATCH {line}\n" in text
    assert re.search(r"#SBATCH --signal=USR\d@90\n", text)
    assert len(contents(tmp_path)) == len(JOBS)


@pytest.mark.parametrize("options", ["cluster=nowhere", "cluster=local,colour=red", "partition=short"])
def test_what_submitit_does_not_know_is_refused(options: str, tmp_path: Path) -> None:
    """The last one, because this machine has no SLURM."""
    with pytest.raises(ArgumentError, match="backend: expected a cluster and options that submitit knows"):
        run(JOBS, Cache(tmp_path), find_backend(f"slurm:{options}"))


def test_chunks_take_about_ten_minutes_and_fit_an_array() -> None:
    seconds = [900.0, 300.0, 200.0, 200.0, 1.0]
    jobs = [Job("backends:square", (number,), size) for number, size in enumerate(seconds)]
    assert [[job.seconds for job in chunk] for chunk in slurm.chunked(jobs)] == [
        [900.0],
        [300.0, 200.0],
        [200.0, 1.0],
    ]
    assert [job for chunk in slurm.chunked(jobs) for job in chunk] == jobs
    many = [Job("backends:square", (0,), 599.0)] * 5_000
    assert len(slurm.chunked(many)) <= slurm.MAX_CHUNKS
