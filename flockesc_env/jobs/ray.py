"""The back end ``ray``: tasks of a Ray cluster. The driver writes the results; no shared disk is needed."""

from collections import deque
from collections.abc import Sequence

import ray

from flockesc_env.common.errors import InputError
from flockesc_env.jobs.job import Cache, Job, Outcome, Outcomes

WINDOW = 4_000
"""Tasks that are submitted and not finished: more than any cluster runs, few enough to wait for."""


def ray_tasks(jobs: Sequence[Job], cache: Cache, address: str | None = None) -> Outcomes:
    """Run jobs as Ray tasks of one CPU each, which Ray starts again for as long as their nodes die.

    Without an address the cluster is that of RAY_ADDRESS or, without it, this machine.
    """
    own = not ray.is_initialized()
    if own:
        try:
            ray.init(address, log_to_driver=False, logging_level="WARNING")
        except (ConnectionError, ValueError) as error:
            raise InputError("backend", "a Ray cluster that can be reached", error) from None
    attempt = ray.remote(num_cpus=1, max_retries=-1)(Job.attempt)
    cores = int(ray.cluster_resources().get("CPU", 1))
    waiting, pending = deque(jobs), dict[ray.ObjectRef, Job]()
    try:
        while waiting or pending:
            while waiting and len(pending) < WINDOW:
                job = waiting.popleft()
                pending[attempt.remote(job)] = job
            ready, _ = ray.wait(list(pending), num_returns=1)
            for task in ready:
                job = pending.pop(task)
                try:
                    found = ray.get(task)
                except ray.exceptions.RayError as error:
                    found = str(error)
                yield Outcome(job, cache.keep(job, found), min(cores, len(pending)))
    finally:
        if own:
            ray.shutdown()  # ends its tasks, too
        else:
            for task in pending:
                ray.cancel(task, force=True)
