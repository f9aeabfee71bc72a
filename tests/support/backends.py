"""Functions of jobs for tests. As a program: ``FUNCTION COUNT CACHE BACKEND SECONDS`` runs jobs."""

import os
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import flockesc_env
from flockesc_env import FlockScenario
from flockesc_env.common.checks import as_threads
from flockesc_env.jobs import Arrays, Cache, Job, find_backend, run
from flockesc_env.jobs.sweeps import OUTCOMES, seed_jobs

if TYPE_CHECKING:  # every worker process imports this file, and pytest takes half of that time
    import pytest

CALLS = "CALLS_OF_JOBS"
"""Environment variable: a folder in which every call leaves a file."""
SMALL = FlockScenario(num_agents=12, num_steps=9)
SQUARE = "backends:square"


def note_calls(tmp_path: Path, monkeypatch: "pytest.MonkeyPatch") -> Path:
    """Note calls in a folder, and let processes that submitit starts import this package and helpers."""
    folder = tmp_path / "calls"
    folder.mkdir()
    monkeypatch.setenv(CALLS, str(folder))
    if find_spec("submitit"):
        monkeypatch.setattr("flockesc_env.jobs.slurm.POLL_SECONDS", 0.05)
    support, package = Path(__file__).parent, Path(flockesc_env.__file__).parents[1]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(support), str(package)]))
    return folder


def note_call(number: int) -> int:
    """Leave a file that names a call and its process; return how many there are for this number."""
    folder = Path(os.environ[CALLS])
    (folder / f"{number}-{os.getpid()}-{os.urandom(4).hex()}").touch()
    return len(list(folder.glob(f"{number}-*")))


def square(number: int) -> Arrays:
    """Return a square; from 100 on it takes longer than any test."""
    note_call(number)
    time.sleep(0.02 if number < 100 else 1_000)
    return {"square": np.array(number**2)}


def slow_square(number: int) -> Arrays:
    note_call(number)
    time.sleep(1.0)
    return {"square": np.array(number**2)}


def held_square(number: int) -> Arrays:
    """Return a square, but not while a file holds all calls back."""
    note_call(number)
    while Path(os.environ[CALLS]).with_suffix(".hold").exists():
        time.sleep(0.1)
    return {"square": np.array(number**2)}


def dies_once(number: int) -> Arrays:
    """Return a square; the first call for the number 5 notes the results so far and kills its process."""
    if note_call(number) == 1 and number == 5:
        folder = Path(os.environ[CALLS]).parent
        (folder / "stored").write_text("\n".join(contents(folder / "cache")))
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": np.array(number**2)}


def dies(number: int) -> Arrays:
    """Return a square; calls for the number 1 kill their process."""
    note_call(number)
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"square": np.array(number**2)}


def fails(number: int) -> Arrays:
    """Return a square; the odd ones fail."""
    note_call(number)
    if number % 2:
        raise ZeroDivisionError(f"odd {number}")
    return {"square": np.array(number**2)}


def misbehaves(number: int) -> Any:
    """Return a square, and for all numbers but 0 something that is no result, or exit."""
    if number == 5:
        sys.exit("done")
    if number == 6:
        return {"long" * 16_383: 0}
    square, fields = np.array(number**2), np.zeros(1, [(f"field_{index}", "f8") for index in range(1_000)])
    others = [{1: square}, {"file": square}, {"x": square, "x.npy": square}, None]
    return [{"square": square, "fields": fields}, *others][number]


def unreadable(number: int) -> Any:
    """Return a number that is hidden, that NumPy cannot read, or whose type npz files do not keep."""
    import argument_table  # slow to import, as is ml_dtypes, which comes with jax
    import ml_dtypes

    return {"values": [*argument_table.unreadable(np.ones(3)), ml_dtypes.bfloat16(1)][number]}


def threads() -> Arrays:
    return {"engine": np.array(as_threads(None)), "blas": np.array(int(os.environ["OMP_NUM_THREADS"]))}


def large(number: int) -> Arrays:
    return {"noise": np.random.default_rng(number).random(250_000)}


def jobs_of(name: str, count: int = 12, seconds: float = 1.0) -> list[Job]:
    return [Job(f"backends:{name}", (number,), seconds) for number in range(count)]


def start_driver(
    name: str, count: int, cache: Path, backend: str, seconds: float = 1.0, environment: Any = None
) -> "subprocess.Popen[str]":
    """Run jobs in another process, with its own process group, as a terminal does."""
    words = map(str, (name, count, cache, backend, seconds))
    streams: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    command = [sys.executable, "-m", "backends", *words]
    return subprocess.Popen(command, env=environment, start_new_session=True, **streams)  # noqa: S603


def sweep_jobs() -> list[Job]:
    ranges = (0.0, 10.0, 100.0)
    return [job for first in range(6) for job in seed_jobs(OUTCOMES, SMALL, ranges, range(first, first + 5))]


def calls(folder: Path, number: int | None = None) -> int:
    """Return how many calls there were, for one number or for all."""
    return len(list(folder.glob("*" if number is None else f"{number}-*")))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.npz"))}


if __name__ == "__main__":
    name, count, cache, backend, seconds = sys.argv[1:]
    run(jobs_of(name, int(count), float(seconds)), Cache(Path(cache)), find_backend(backend))
    print("done")
