"""The back end ``slurm``: array jobs of SLURM by submitit. Workers write the results to a shared disk."""

import os
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import submitit
from submitit.core.utils import FailedJobError
from submitit.helpers import DelayedSubmission
from tqdm import tqdm

from flockesc_env.common.errors import InputError, JobError
from flockesc_env.jobs.job import Cache, Job, Outcome, Outcomes
from flockesc_env.jobs.processes import one_thread_each

CHUNK_SECONDS = 600.0
"""Estimated time of an array task: long beside its start, short beside usual time limits."""
MAX_CHUNKS = 1_000
"""SLURM's default ``MaxArraySize`` is 1,001."""
POLL_SECONDS = 1.0
QUEUE_SECONDS = 15.0
"""Time between two calls of ``squeue``. A task without a result has ended when two calls say so."""
ATTEMPTS = 4
"""An array task that ends without a result, because it was killed, is submitted so often."""
SQUEUE = ["squeue", "--me", "--array", "--states=all", "--noheader", "--format=%i|%T|%r"]
HELD, FORGOTTEN = "HELD", "FORGOTTEN"
_STOPPED = ("CANCELLED", "DEADLINE", "PREEMPTED", "REVOKED", "TIMEOUT", HELD, FORGOTTEN)
_FAILED = ("BOOT_FAIL", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY")
ENDED = {"COMPLETED", *_STOPPED, *_FAILED}
"""Final states: ``squeue`` shows tasks that SLURM requeues as COMPLETING or PENDING."""
Task = submitit.Job[dict[str, str]]


@dataclass(frozen=True)
class Chunk:
    """Jobs of one array task, with a cache on a disk that the driver and all nodes share.

    When SLURM requeues the task, it skips the results that are there.
    """

    cache: Cache
    path: tuple[str, ...] = field(default_factory=lambda: tuple(sys.path))

    def __call__(self, jobs: Sequence[Job]) -> dict[str, str]:
        """Run the jobs that the cache lacks, with the driver's modules; return the errors by key."""
        sys.path += [folder for folder in self.path if folder not in sys.path]
        errors = {job.key: self.cache.keep(job, job.attempt()) for job in jobs if job not in self.cache}
        return {key: error for key, error in errors.items() if error is not None}

    def checkpoint(self, jobs: Sequence[Job]) -> DelayedSubmission:
        """Return the same call: submitit requeues it after a time limit or a preemption."""
        return DelayedSubmission(self, jobs)


class Queue:
    """States of array tasks by ``squeue``. submitit's ``sacct`` fails on a cluster without accounting."""

    def __init__(self) -> None:
        self._states = dict[str, str]()
        self._done = set[str]()

    def ask(self, tasks: Iterable[str]) -> None:
        """Ask for the states of all tasks at once; raise ``JobError`` if SLURM does not answer."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SQUEUE_")}
        try:
            answer = subprocess.run(SQUEUE, env=environment, capture_output=True, check=True, text=True)  # noqa: S603
        except (OSError, subprocess.CalledProcessError) as error:
            reason = getattr(error, "stderr", "") or str(error)
            raise JobError(f"squeue does not answer: {reason.strip()}") from None
        lines = [line.split("|", 2) for line in answer.stdout.splitlines()]
        # After a failed launch SLURM requeues a task, and holds it until somebody releases it.
        states = {task: HELD if reason.startswith("launch") else state for task, state, reason in lines}
        for task in tasks:
            before = self._states.get(task, "PENDING")
            gone = "CANCELLED" if before == "CANCELLED" else FORGOTTEN
            now = self._states[task] = states.get(task, gone)
            if before in ENDED and now in ENDED:
                self._done.add(task)

    def get_state(self, task: str, **_: str) -> str:
        """Return the last known state."""
        return self._states.get(task, "UNKNOWN")

    def is_done(self, task: str, **_: str) -> bool:
        """Return whether the last two answers agree that a task has ended."""
        return task in self._done


def slurm(jobs: Sequence[Job], cache: Cache, cluster: str = "slurm", **options: int | str) -> Outcomes:
    """Run jobs in array tasks of one core; the cluster "local" is this machine.

    The options are those of sbatch, by the names that submitit gives them; ``time`` is in minutes.
    """
    if not jobs:
        return
    queue, due = Queue(), 0.0

    def submit(chunks: Sequence[Sequence[Job]], attempt: int) -> dict[Task, tuple[Sequence[Job], int]]:
        with one_thread_each():
            submitted = executor.map_array(Chunk(cache), chunks)
        for task in submitted:
            task.watcher = queue  # type: ignore[assignment]  # the tasks ask it for their states
        return {task: (chunk, attempt) for task, chunk in zip(submitted, chunks, strict=True)}

    folder = cache.folder / "slurm"
    if not str(folder).isprintable() or {"%", "\\"} & set(str(folder)):
        raise InputError("cache", "a path without % and \\ for slurm, which replaces patterns in it", folder)
    values = {"time": 60, "cpus_per_task": 1, "job_name": "flockesc"} | options
    try:
        executor = submitit.AutoExecutor(folder, cluster)
        executor.update_parameters(
            timeout_min=values["time"], **{f"slurm_{name}": value for name, value in values.items()}
        )
        if cluster == "slurm":
            queue.ask([])
        tasks = submit(chunked(jobs), 1)
    except (AssertionError, NameError, RuntimeError, ValueError) as error:
        raise InputError("backend", "a cluster that answers and options that it knows", error) from None
    try:
        while tasks:
            if cluster == "slurm" and time.monotonic() >= due:
                try:
                    queue.ask(task.job_id for task in tasks)
                except JobError as error:
                    tqdm.write(f"{error}; waiting", file=sys.stderr)
                due = time.monotonic() + QUEUE_SECONDS
            for task in [task for task in tasks if task.done()]:
                chunk, attempt = tasks.pop(task)
                errors, failure = ending(task)
                if task.state == HELD:
                    task.cancel(check=False)
                lost = [job for job in chunk if job not in cache] if failure else []
                again = list[Job]()
                if lost and attempt < ATTEMPTS and not was_cancelled(task):
                    # The first may have killed the process: it is the last one of the next attempt.
                    again = [*lost[1:], lost[0]]
                    try:
                        tasks |= submit([again], attempt + 1)
                    except FailedJobError as error:
                        again, failure = [], f"{failure}\n{error}"
                for job in chunk:
                    if job not in again:
                        yield Outcome(job, failure if job in lost else errors.get(job.key), len(tasks))
            time.sleep(POLL_SECONDS)
    finally:
        for task in tasks:
            task.cancel(check=False)


def ending(task: Task) -> tuple[dict[str, str], str | None]:
    """Return the errors of a task's jobs by key, or why the task left no result."""
    if task.paths.result_pickle.exists():
        failure = task.exception()
        return ({}, str(failure)) if failure else (task.result(), None)
    if was_cancelled(task):
        return {}, f"array task {task.job_id} was cancelled; run the same again to continue"
    log = task.paths.stderr
    text = log.read_text(errors="replace")[-2_000:] if log.exists() else "no log"
    return {}, f"array task {task.job_id} ended without a result ({task.state}); {log}:\n{text}"


def was_cancelled(task: Task) -> bool:
    """Return whether a user cancelled a task.

    SLURM forgets a task that was cancelled before it started, some minutes after its end, or when slurmctld
    crashes before it has saved the task. A task that has started has a log.
    """
    return task.state == "CANCELLED" or (task.state == FORGOTTEN and not task.paths.stderr.exists())


def chunked(jobs: Sequence[Job]) -> list[list[Job]]:
    """Cut jobs into chunks of about ``CHUNK_SECONDS``, longer ones if there were more than ``MAX_CHUNKS``."""
    most = max(CHUNK_SECONDS, sum(job.seconds for job in jobs) / MAX_CHUNKS * 2)
    chunks, size = [], most
    for job in jobs:
        if size + job.seconds > most:
            chunks.append(list[Job]())
            size = 0.0
        chunks[-1].append(job)
        size += job.seconds
    return chunks
