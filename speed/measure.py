"""Timing of candidates. They take turns, so that changes of the machine's speed affect all equally."""

from __future__ import annotations

import gc
import math
import os
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, Self

Clock = Literal["cpu", "wall"]
Case = dict[str, Any]
_CLOCKS: dict[Clock, Callable[[], float]] = {"cpu": time.process_time, "wall": time.perf_counter}

_SHORTEST = 0.05
"""Minimum duration of a repetition in s; short candidates are called several times."""
_LONG = 1.0
"""Candidates that take longer than this, in s, are repeated ``_LONG_REPETITIONS`` times."""
_QUICK_REPETITIONS = _LONG_REPETITIONS = 3


@dataclass(frozen=True)
class Candidate:
    """An implementation to time.

    Attributes:
        name: name in tables and figures.
        run: the function to time.
        units: number of units of work per call, for example flock steps.
        before: its time is subtracted, to exclude setup that ``run`` also does; ``None``: nothing.
        case: parameters that distinguish this candidate from others of the same name.
    """

    name: str
    run: Callable[[], object]
    units: float
    before: Callable[[], object] | None = None
    case: Case = field(default_factory=dict)


@dataclass(frozen=True)
class Record:
    """Measurements of one candidate in one case.

    Attributes:
        section: name of the benchmark.
        contender: name of the candidate.
        case: parameters of the case, for example ``{"n": 300, "rho": 10.0}``.
        unit: the unit of work that ``seconds`` refers to.
        clock: ``"cpu"``: processor time of the process; ``"wall"``: wall-clock time.
        seconds: time per unit in s, one entry per repetition.
        note: reason why ``seconds`` is empty; otherwise empty.
    """

    section: str
    contender: str
    case: Case
    unit: str
    clock: Clock
    seconds: list[float]
    note: str = ""

    @property
    def median(self) -> float:
        """Median over repetitions in s; NaN if there are none."""
        return statistics.median(self.seconds) if self.seconds else math.nan

    def document(self) -> dict[str, Any]:
        """Return the record as JSON data."""
        return {**asdict(self), "median": self.median if self.seconds else None}

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """Return the record of JSON data."""
        return cls(**{name: value for name, value in document.items() if name != "median"})


@dataclass(frozen=True)
class Comparison:
    """Candidates that are measured in turns.

    Attributes:
        candidates: the candidates.
        unit: the unit of work.
        case: parameters of the case, added to those of the candidates.
        clock: the clock; candidates on the clock of the processor run on one core.
        repetitions: their number; candidates that take over a second have at most three.
        skipped: reasons to leave out further candidates, by name.
    """

    candidates: list[Candidate]
    unit: str
    case: Case = field(default_factory=dict)
    clock: Clock = "cpu"
    repetitions: int = 5
    skipped: dict[str, str] = field(default_factory=dict)


def measure(section: str, comparison: Comparison, *, quick: bool = False) -> list[Record]:
    """Call every candidate once to warm up, then time all in turns."""
    candidates, clock = comparison.candidates, comparison.clock
    seconds: list[list[float]] = [[] for _ in candidates]
    with cores(1) if clock == "cpu" else nullcontext():
        calls = [max(1, math.ceil(_SHORTEST / _time(entry.run, 1, clock))) for entry in candidates]
        for repetition in range(_QUICK_REPETITIONS if quick else comparison.repetitions):
            for entry, count, taken in zip(candidates, calls, seconds, strict=True):
                is_long = taken and taken[0] * entry.units > _LONG
                if not (is_long and repetition >= _LONG_REPETITIONS):
                    spent = _time(entry.run, count, clock)
                    spent -= _time(entry.before, count, clock) if entry.before else 0.0
                    taken.append(spent / (count * entry.units))

    def record(name: str, case: Case, taken: list[float], note: str = "") -> Record:
        return Record(section, name, {**comparison.case, **case}, comparison.unit, clock, taken, note)

    return [
        *(record(name, {}, [], reason) for name, reason in comparison.skipped.items()),
        *(record(entry.name, entry.case, taken) for entry, taken in zip(candidates, seconds, strict=True)),
    ]


def _time(run: Callable[[], object], calls: int, clock: Clock) -> float:
    now = _CLOCKS[clock]
    gc.collect()
    gc.disable()
    try:
        start = now()
        for _ in range(calls):
            run()
        return now() - start
    finally:
        gc.enable()


@contextmanager
def cores(count: int) -> Iterator[None]:
    """Pin this thread, and threads that it starts, to ``count`` cores."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(before)[-count:])
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
