"""Training runs as jobs: the result of a run is the files of its folder."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from flockesc_env.common.files import atomic_write
from flockesc_env.jobs import Arrays, Cache, Job
from training.config import Args
from training.record import CONFIG_FILE, CURVE_FILE, POLICY_FILE, RUN_FILE

RUN_SECONDS = 600.0
"""Estimated time of a run: one chunk on SLURM."""


def run_job(args: Args) -> Job:
    """Return the job that does, or finishes, a training run in its folder."""
    args = dataclasses.replace(args, run=args.run.absolute(), progress=False)
    return Job("training.runs:run", (args,), RUN_SECONDS)


def run(args: Args) -> Arrays:
    """Do, or finish, a training run; return the bytes of its files by their names."""
    from training.train import train  # takes seconds to import

    if not (args.run / POLICY_FILE).is_file():  # another driver may have finished it
        train(args)
    return run_files(args.run)


def run_files(folder: Path) -> Arrays:
    """Return the bytes of the files of a finished run by their names, the policy last."""
    names = (CONFIG_FILE, CURVE_FILE, RUN_FILE, POLICY_FILE)
    return {name: np.frombuffer((folder / name).read_bytes(), np.uint8) for name in names}


class RunFolders(Cache):
    """Folders of training runs. A finished run has its policy, which is written last."""

    def path(self, job: Job) -> Path:
        """Return the file of the run's policy."""
        args: Args = job.arguments[0]
        return args.run / POLICY_FILE

    def put(self, job: Job, results: Arrays) -> None:
        """Write the files of a run that was done on another disk."""
        if job not in self:
            self.path(job).parent.mkdir(parents=True, exist_ok=True)
            for name, content in results.items():
                with atomic_write(self.path(job).with_name(name)) as file:
                    file.write(content.tobytes())

    def find(self, job: Job) -> Arrays | None:
        """Return the bytes of the files of a run, or None if it is not finished."""
        return run_files(self.path(job).parent) if self.path(job).is_file() else None
