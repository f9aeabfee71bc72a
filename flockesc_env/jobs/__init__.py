"""Jobs (pure functions with plain arguments) and a cache of their results."""

from flockesc_env.jobs.cache import Cache
from flockesc_env.jobs.job import Arrays, Job

__all__ = ["Arrays", "Cache", "Job"]
