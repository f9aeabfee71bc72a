"""``Cache``: results of jobs in a folder, one file per job."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flockesc_env.common.files import atomic_write
from flockesc_env.jobs.job import Arrays, Job


class Cache:
    """A folder with one npz file per job; the key of the job is the file name.

    Args:
        folder: path of the folder; it is created when the first result is saved.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def get(self, job: Job) -> Arrays:
        """Return the results of a job; compute and save them if there is no file."""
        path = self.folder / f"{job.key()}.npz"
        if not path.exists():
            results = job.run()
            self.folder.mkdir(parents=True, exist_ok=True)
            with atomic_write(path) as file:
                np.savez_compressed(file, allow_pickle=False, **results)
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
