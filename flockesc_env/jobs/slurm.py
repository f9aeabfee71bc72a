"""The back end ``slurm``: array jobs of SLURM by submitit. Workers write the results to a shared disk."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import submitit
from submitit.helpers import DelayedSubmission

from flockesc_env.common.errors import ArgumentError
from flockesc_env.common.in_job import one_thread_each
from flockesc_env.jobs.cache import Cache
from flockesc_env.jobs.job import Job, Outcome, Outcomes

CHUNK_SECONDS = 600.0
"""Estimated time of an array task: long beside its start, short beside usual time limits."""
MAX_CHUNKS = 1_000
"""SLURM's default ``MaxArraySize`` is 1,001."""
POLL_SECONDS = 1.0
ATTEMPTS = 4
"""An array task that ends without a result, because it was killed, is submitted so often."""


@dataclass(frozen=True)
class Chunk:
    """Jobs of one array task. When SLURM requeues it, it skips the results that are there.

    Attributes:
        cache: on a disk that the driver and all nodes share.
    """

    cache: Cache

    def __call__(self, jobs: Sequence[Job]) -> dict[str, str]:
        """Run the jobs that the cache lacks; return the errors by key."""
        errors = {job.key: self.cache.keep(job, job.attempt()) for job in jobs if job not in self.cache}
        return {key: error for key, error in errors.items() if error is not None}

    def checkpoint(self, jobs: Sequence[Job]) -> DelayedSubmission:
        """Return the same call: submitit requeues it after a time limit or a preemption."""
        return DelayedSubmission(self, jobs)


def slurm(jobs: Sequence[Job], cache: Cache, cluster: str = "slurm", **options: int | str) -> Outcomes:
    """Run jobs in array tasks of one core.

    Args:
        jobs: the jobs.
        cache: in a folder that all nodes share.
        cluster: "slurm", or "local" for processes of this machine.
        options: of sbatch, by the names that submitit gives them; ``time`` is in minutes.
    """
    values = {"time": 60, "cpus_per_task": 1, "job_name": "flockesc"} | options
    try:
        executor = submitit.AutoExecutor(cache.folder / "slurm", cluster)
        executor.update_parameters(
            timeout_min=values["time"],
            **{f"slurm_{name}": value for name, value in values.items()},
        )
    except (AssertionError, NameError, RuntimeError, ValueError) as error:
        raise ArgumentError("backend", "a cluster and options that submitit knows", error) from None
    run, chunks = Chunk(cache), chunked(jobs)
    with one_thread_each():
        submitted = executor.map_array(run, chunks)
    tasks = {task: (chunk, 1) for task, chunk in zip(submitted, chunks, strict=True)}
    try:
        while tasks:
            for task in [task for task in tasks if task.done()]:
                (chunk, attempt), failure = tasks.pop(task), task.exception()
                errors = {} if failure else task.result()
                lost = [job for job in chunk if job not in cache] if failure else []
                if lost and attempt < ATTEMPTS:  # the first may have killed the process: last in the next try
                    with one_thread_each():
                        tasks[executor.submit(run, [*lost[1:], lost[0]])] = lost, attempt + 1
                else:
                    errors |= {job.key: str(failure) for job in lost}
                    lost = []
                for job in chunk:
                    if job not in lost:
                        yield Outcome(job, errors.get(job.key), len(tasks))
            time.sleep(POLL_SECONDS)
    finally:
        for task in tasks:
            task.cancel(check=False)


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
