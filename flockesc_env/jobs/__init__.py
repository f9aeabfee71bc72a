"""Jobs (pure functions with plain arguments), the cache of their results, and back ends that run them."""

from flockesc_env.common.errors import JobError
from flockesc_env.jobs.driver import BACKENDS, Backend, find_backend, run, run_jobs
from flockesc_env.jobs.job import Arrays, Cache, Job

__all__ = ["BACKENDS", "Arrays", "Backend", "Cache", "Job", "JobError", "find_backend", "run", "run_jobs"]
