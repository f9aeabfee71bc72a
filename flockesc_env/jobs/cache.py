"""``Cache``: results of jobs in a folder, one file per job."""

from __future__ import annotations

import time
import warnings
from io import BytesIO
from pathlib import Path

import numpy as np

from flockesc_env.common.errors import JobError
from flockesc_env.common.files import read_sealed, write_sealed
from flockesc_env.jobs.job import Arrays, Job

GRACE_SECONDS = 60.0
"""A network file system may show a file that another machine wrote only after this time."""


class Cache:
    """A folder with one npz file per job; the key of the job is the file name.

    Several drivers and workers may share a folder: equal keys hold equal bytes, and files appear complete.
    A file ends with a hash of its content and of the key. The folder is created with the first result.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder).absolute()

    def path(self, job: Job) -> Path:
        """Return the file that holds the results of a job."""
        return self.folder / f"{job.key}.npz"

    def __contains__(self, job: Job) -> bool:
        return self.find(job) is not None

    def find(self, job: Job) -> Arrays | None:
        """Return the results of a job, or None if they are missing or, with a warning, cannot be read."""
        path = self.path(job)
        try:
            packed = read_sealed(path, job.key)
        except FileNotFoundError:
            return None
        except (IsADirectoryError, PermissionError):
            packed = None
        if packed is None:
            given = "a folder, a damaged file or another job's"
            message = f"{path}: expected the results of a job, got {given}; the job runs again"
            warnings.warn(message, stacklevel=2)
            return None
        with np.load(BytesIO(packed), allow_pickle=False) as stored:
            return dict(stored.items())

    def put(self, job: Job, results: Arrays) -> None:
        """Keep the results of a job."""
        packed = BytesIO()
        np.savez_compressed(packed, allow_pickle=False, **results)
        self.folder.mkdir(parents=True, exist_ok=True)
        # A file that a power failure damages is found and computed again.
        write_sealed(self.path(job), job.key, packed.getvalue(), durable=False)

    def keep(self, job: Job, found: Arrays | str) -> str | None:
        """Keep what ``Job.attempt`` returned: put results into the cache. Return the error, if any."""
        if isinstance(found, str):
            return found
        try:
            self.put(job, found)
        except OSError as error:
            return f"its results cannot be written: {error}"
        return None

    def get(self, job: Job) -> Arrays:
        """Return the results of a job.

        Raises:
            JobError: if its file has not appeared after ``GRACE_SECONDS``.
        """
        end = time.monotonic() + GRACE_SECONDS
        while (results := self.find(job)) is None:
            if time.monotonic() > end:
                found = "no such file, or a damaged one"
                raise JobError(f"result of a finished job: expected {self.path(job)}, got {found}")
            time.sleep(0.1)
            if self.folder.is_dir():
                list(self.folder.iterdir())  # asks a network file system for new names
        return results
