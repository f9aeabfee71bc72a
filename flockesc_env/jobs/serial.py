"""The back end ``serial``: one job after another in this process."""

from __future__ import annotations

from collections.abc import Sequence

from flockesc_env.jobs.cache import Cache
from flockesc_env.jobs.job import Job, Outcome, Outcomes


def serial(jobs: Sequence[Job], cache: Cache) -> Outcomes:
    """Run jobs in this process."""
    for job in jobs:
        yield Outcome(job, cache.keep(job, job.attempt()), 1)
