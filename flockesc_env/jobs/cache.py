"""``Cache``: results of jobs in a folder, one file per job."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from flockesc_env.common.errors import JobError
from flockesc_env.common.files import atomic_write
from flockesc_env.jobs.job import Arrays, Job

GRACE_SECONDS = 60.0
"""A network file system may show a file that another machine wrote only after this time."""


class Cache:
    """A folder with one npz file per job; the key of the job is the file name.

    Several drivers and workers may share a folder: equal keys hold equal bytes, and files appear complete.

    Args:
        folder: path of the folder; it is created when the first result is saved.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder).absolute()

    def path(self, job: Job) -> Path:
        """Return the file that holds the results of a job."""
        return self.folder / f"{job.key}.npz"

    def __contains__(self, job: Job) -> bool:
        return self.path(job).is_file()

    def put(self, job: Job, results: Arrays) -> None:
        """Keep the results of a job."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with atomic_write(self.path(job)) as file:
            np.savez_compressed(file, allow_pickle=False, **results)

    def keep(self, job: Job, found: Arrays | str) -> str | None:
        """Keep what ``Job.attempt`` returned: results are put into the cache, an error is returned."""
        if isinstance(found, str):
            return found
        self.put(job, found)
        return None

    def get(self, job: Job) -> Arrays:
        """Return the results of a job.

        Raises:
            JobError: if its file has not appeared after ``GRACE_SECONDS``.
        """
        self._wait(job)
        with np.load(self.path(job), allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}

    def _wait(self, job: Job) -> None:
        end = time.monotonic() + GRACE_SECONDS
        while job not in self:
            if time.monotonic() > end:
                raise JobError(f"result of a finished job: expected {self.path(job)}, got no such file")
            time.sleep(0.1)
            if self.folder.is_dir():
                list(self.folder.iterdir())  # asks a network file system for new names
