"""Timing of candidates in turns, so that changes of the machine's speed affect all equally; a run's file."""

import gc
import math
import os
import platform
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from importlib.metadata import distributions
from pathlib import Path
from timeit import Timer
from typing import Any, Literal, Self

import msgspec

PROJECT = "flockesc_env"  # name of this project in tables and figures

EVERY_STEP: dict[str, Any] = {"max_range": 100.0, "predator_sensing_range": 30.0, "steps_per_action": 1}
"""Options of environments under which one call is one model step."""

Clock = Literal["cpu", "wall"]
Call = Callable[[], object]
Case = dict[str, Any]
_CLOCKS: dict[Clock, Callable[[], float]] = {"cpu": time.process_time, "wall": time.perf_counter}

_SHORTEST = 0.05  # minimum duration of a repetition in s; short candidates are called several times
_LONG = 1.0  # candidates that take longer than this, in s, are repeated ``_FEW_REPETITIONS`` times
_REPETITIONS, _FEW_REPETITIONS = 5, 3

_PACKAGES = {
    "flockesc-env", "gymnasium", "jax", "mpe2", "numba", "numpy", "pettingzoo", "scipy", "stable-baselines3",
    "torch", "vmas",
}  # fmt: skip
_FLAGS = ("sse2", "avx", "avx2", "fma", "avx512f", "avx512dq", "avx512vl", "avx512bw")


@dataclass(frozen=True)
class Candidate:
    """An implementation to time."""

    name: str  # in tables and figures
    run: Call
    units: float  # units of work per call of ``run``, for example flock steps
    before: Call | None = None  # its time is subtracted, to exclude setup that ``run`` also does
    case: Case = field(default_factory=dict)  # what distinguishes it from others of the same name


@dataclass(frozen=True)
class Comparison:
    """Candidates that are measured in turns."""

    candidates: list[Candidate]
    unit: str  # of work
    case: Case = field(default_factory=dict)  # added to those of the candidates
    clock: Clock = "cpu"  # processor time of the process, pinned to one core; or wall-clock time


@dataclass(frozen=True)
class Record:
    """Measurements of one candidate: s per unit of work, one entry per repetition."""

    section: str
    implementation: str
    case: Case  # for example {"n": 300, "rho": 10.0}
    unit: str
    clock: Clock
    seconds: list[float]

    @property
    def median(self) -> float:
        """Median over repetitions in s."""
        return statistics.median(self.seconds)


@dataclass(frozen=True)
class Measurements:
    """A run of the benchmarks: the machine, all records, and those of the sections that were repeated."""

    machine: dict[str, Any]
    records: list[Record]
    again: list[Record]

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read the file of a run, without sizes that older versions skipped and recorded without seconds."""
        read = msgspec.json.decode(path.read_bytes(), type=cls)
        return cls(read.machine, [record for record in read.records if record.seconds], read.again)


def measure(section: str, comparison: Comparison, *, quick: bool = False) -> list[Record]:
    """Call every candidate once to warm up, then time all in turns."""
    candidates, clock = comparison.candidates, comparison.clock
    seconds: list[list[float]] = [[] for _ in candidates]
    with cores(1) if clock == "cpu" else nullcontext():
        calls = [max(1, math.ceil(_SHORTEST / spent(entry.run, 1, clock))) for entry in candidates]
        for repetition in range(_FEW_REPETITIONS if quick else _REPETITIONS):
            for entry, count, taken in zip(candidates, calls, seconds, strict=True):
                is_long = taken and taken[0] * entry.units > _LONG
                if not (is_long and repetition >= _FEW_REPETITIONS):
                    time_spent = spent(entry.run, count, clock)
                    time_spent -= spent(entry.before, count, clock) if entry.before else 0.0
                    taken.append(time_spent / (count * entry.units))
    return [
        Record(section, entry.name, {**comparison.case, **entry.case}, comparison.unit, clock, taken)
        for entry, taken in zip(candidates, seconds, strict=True)
    ]


def spent(run: Call, calls: int, clock: Clock) -> float:
    """Return the time of some calls in s, without garbage collections."""
    return Timer(run, gc.collect, _CLOCKS[clock]).timeit(calls)


@contextmanager
def cores(count: int) -> Iterator[None]:
    """Pin this thread, and threads that it starts, to ``count`` cores."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(before)[-count:])
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def machine() -> dict[str, Any]:
    """Return the processor, system, versions and commit."""
    cpu = dict(re.findall(r"(.+?)\s*: (.*)", Path("/proc/cpuinfo").read_text()))
    flags = set(cpu.get("flags", "").split())
    versions = ((found.name.replace("_", "-"), found.version) for found in distributions())
    return {
        "cpu": cpu.get("model name", platform.processor()),
        "cores": os.cpu_count(),
        "load_average": os.getloadavg()[0],  # of the last minute
        "instruction_sets": [flag for flag in _FLAGS if flag in flags],
        "system": platform.platform(),
        "python": platform.python_version(),
        "rust": output("rustc", "--version"),
        "commit": output("git", "describe", "--always", "--dirty", "--abbrev=40"),
        "packages": dict(sorted(pair for pair in versions if pair[0] in _PACKAGES)),
        "command": "python -m speed " + " ".join(sys.argv[1:]),
    }


def output(*command: str) -> str:
    """Return what a command prints; it can import this project."""
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    return subprocess.check_output(command, text=True, env=environment).strip()
