"""The back end ``slurm``: what it submits, and what it concludes from the answers of ``squeue``.

Shell scripts stand for SLURM's commands; tests/slow/test_slurm.py runs a real cluster.
"""

import os
import re
from pathlib import Path

import pytest
from backends import note_calls

from flockesc_env.common.errors import InputError, JobError
from flockesc_env.jobs import Cache, Job, find_backend, run

pytest.importorskip("submitit", reason="no submitit (extra slurm)")

from flockesc_env.jobs import slurm

JOBS = [Job("backends:square", (number,), seconds=200.0) for number in range(6)]
"""Two array tasks. They never run."""
COMMANDS = {
    "srun": "",
    "scancel": 'echo "$1" >> "$0.calls"',
    "sbatch": 'echo >> "$0.calls"; echo Submitted batch job $((11 + $(wc -l < "$0.calls")))',
    "squeue": """
echo >> "$0.calls"
answer=$(sed -n "$(wc -l < "$0.calls")p" "$0.answers")
[ -n "$answer" ] || answer=$(tail -n 1 "$0.answers")
[ "$answer" != fails ] || exit 1
[ "$answer" = nothing ] || echo "$answer" | tr ", " "\\n|" | sed "/|.*|/ ! s/$/|reason/"
""",
}
GONE = [f"{number} FAILED" for number in range(13, 19)]


@pytest.fixture(autouse=True)
def commands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    note_calls(tmp_path, monkeypatch)
    monkeypatch.setattr(slurm, "QUEUE_SECONDS", 0.0)
    folder = tmp_path / "bin"
    folder.mkdir()
    for name, text in COMMANDS.items():
        (folder / name).write_text(f"#!/bin/sh\n{text}\n")
        (folder / name).chmod(0o755)
    (folder / "squeue.answers").write_text("12_0 CANCELLED,12_1 CANCELLED None\n")
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    return folder


def test_what_slurm_is_asked_for(tmp_path: Path) -> None:
    backend = find_backend("slurm:partition=short,time=30,account=flocks,array_parallelism=2")
    with pytest.raises(JobError, match="6 of 6 jobs failed"):
        run(JOBS, Cache(tmp_path), backend)
    text = (tmp_path / "slurm" / "12_submission.sh").read_text()
    options = ("partition=short", "time=30", "account=flocks", "array=0-1%2", "cpus-per-task=1")
    for option in (*options, "job-name=flockesc"):
        assert f"#SBATCH --{option}\n" in text
    assert re.search(r"#SBATCH --signal=USR\d@90\n", text)


STARTED_AGAIN = {
    "cancelled": (["12_0 CANCELLED,12_1 CANCELLED"], 1, "12_1 was cancelled; run the same again to continue"),
    "never started": (["12_0 PENDING,12_1 PENDING", "nothing"], 1, "12_1 was cancelled"),
    "forgotten": (["12_0 RUNNING,12_1 RUNNING", "nothing"], 3, "14 was cancelled"),
    "lost": (["12_0 PENDING,12_1 PENDING", "nothing"], 3, "14 was cancelled"),
    "killed": (
        [",".join(["12_0 FAILED", "12_1 TIMEOUT", *GONE])],
        7,
        r"18 ended without a result \(FAILED\)",
    ),
    "preempted": (["12_0 PREEMPTED,12_1 CANCELLED"], 2, "13 was cancelled"),
    "held": (["12_0 PENDING launch_failed_requeued_held,12_1 CANCELLED"], 2, "13 was cancelled"),
    "no answer": (
        ["12_0 RUNNING,12_1 RUNNING", "fails", "fails", "12_0 CANCELLED,12_1 CANCELLED"],
        1,
        "12_1 was",
    ),
    "requeued": (
        [
            *("12_0 CONFIGURING,12_1 SUSPENDED", "12_0 NODE_FAIL,12_1 COMPLETING"),
            *("12_0 PENDING,12_1 CANCELLED", "12_0 CANCELLED,12_1 CANCELLED"),
        ],
        1,
        "12_0 was cancelled",
    ),
}
"""Answers of squeue, the number of submissions and the last message."""


@pytest.mark.parametrize("name", STARTED_AGAIN)
def test_which_tasks_are_started_again(name: str, tmp_path: Path, commands: Path) -> None:
    answers, submissions, last = STARTED_AGAIN[name]
    if name in {"forgotten", "lost"}:  # the tasks have started
        (tmp_path / "slurm").mkdir()
        for log in ("12_0_0_log.err", "12_1_0_log.err"):
            (tmp_path / "slurm" / log).touch()
    (commands / "squeue.answers").write_text("\n".join(["nothing", *answers]) + "\n")
    with pytest.raises(JobError, match=f"(?s)6 of 6 jobs failed.*array task {last}"):
        run(JOBS, Cache(tmp_path), find_backend("slurm"))
    assert (commands / "sbatch.calls").read_text().count("\n") == submissions
    cancelled = (commands / "scancel.calls").read_text() if (commands / "scancel.calls").exists() else ""
    assert cancelled == ("12_0\n" if "held" in answers[0] else "")


@pytest.mark.parametrize(
    ("options", "command", "reason"),
    [
        ("cluster=nowhere", "", "AutoExecutor doesn't know any executor named nowhere"),
        ("cluster=local,colour=red", "", "slurm_colour"),
        ("partition=short", "squeue", "squeue does not answer: no such partition"),
        ("partition=short", "sbatch", "no such partition"),
    ],
)
def test_what_cannot_run_is_refused(
    options: str, command: str, reason: str, tmp_path: Path, commands: Path
) -> None:
    if command:
        (commands / command).write_text("#!/bin/sh\necho no such partition >&2; exit 1\n")
    with pytest.raises(InputError, match="backend: expected a cluster that answers and options") as caught:
        run(JOBS, Cache(tmp_path), find_backend(f"slurm:{options}"))
    assert reason in str(caught.value)


@pytest.mark.parametrize("name", ["%j", "of-%A", "back\\slash", "line\nbreak"])
def test_a_cache_whose_path_slurm_would_change_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cache: expected a path without % and \\ for slurm, .*slurm"):
        run(JOBS, Cache(tmp_path / name), find_backend("slurm:cluster=local"))
    assert not list(tmp_path.glob(f"{name}*"))


def test_chunks_take_about_ten_minutes_and_fit_an_array() -> None:
    seconds = [900.0, 300.0, 200.0, 200.0, 1.0]
    jobs = [Job("backends:square", (number,), size) for number, size in enumerate(seconds)]
    chunks = [[job.seconds for job in chunk] for chunk in slurm.chunked(jobs)]
    assert chunks == [[900.0], [300.0, 200.0], [200.0, 1.0]]
    assert [job for chunk in slurm.chunked(jobs) for job in chunk] == jobs
    assert len(slurm.chunked([Job("backends:square", (0,), 599.0)] * 5_000)) <= slurm.MAX_CHUNKS
