"""Timing: contenders take turns, so that a drift of the machine hits all alike."""

from __future__ import annotations

import gc
import math
import os
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, Self

Clock = Literal["cpu", "wall"]
_CLOCKS: dict[Clock, Callable[[], float]] = {"cpu": time.process_time, "wall": time.perf_counter}

_SHORTEST = 0.05
"""A repetition calls its contender as often as it takes to fill this many seconds."""
_LONG = 1.0
_REPETITIONS_OF_LONG = 3


@dataclass(frozen=True)
class Candidate:
    """Something to time.

    Attributes:
        name: in tables and figures.
        run: what is timed.
        units: how many of the record's units one call does.
        before: timed as well and taken off, so that a set-up that both share does not count.
        case: what tells this contender's record from others, beside the name.
    """

    name: str
    run: Callable[[], object]
    units: float
    before: Callable[[], object] | None = None
    case: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Record:
    """One contender's repetitions in one case.

    Attributes:
        section: which benchmark.
        contender: who.
        case: what, for instance ``{"n": 300, "rho": 10.0}``.
        unit: what ``seconds`` are the cost of.
        clock: processor time of the whole process, or time on the wall.
        seconds: one entry per repetition, in the order in which they were taken.
        note: why there are none.
    """

    section: str
    contender: str
    case: dict[str, Any]
    unit: str
    clock: Clock
    seconds: list[float]
    note: str = ""

    @property
    def median(self) -> float:
        """Return the median over repetitions in s, not a number if there are none."""
        return statistics.median(self.seconds) if self.seconds else math.nan

    def document(self) -> dict[str, Any]:
        """Return what the JSON file holds."""
        return {**asdict(self), "median": self.median if self.seconds else None}

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """Return the record that a JSON file holds."""
        return cls(**{name: value for name, value in document.items() if name != "median"})


def measure(
    section: str,
    contenders: list[Candidate],
    unit: str,
    *,
    repetitions: int,
    clock: Clock = "cpu",
    case: dict[str, Any] | None = None,
) -> list[Record]:
    """Warm every contender up once, then time them in turns; what takes over a second, three times only."""
    calls = [max(1, math.ceil(_SHORTEST / _time(entry.run, 1, clock))) for entry in contenders]
    seconds: list[list[float]] = [[] for _ in contenders]
    for repetition in range(repetitions):
        for entry, count, taken in zip(contenders, calls, seconds, strict=True):
            is_long = taken and taken[0] * entry.units > _LONG
            if not (is_long and repetition >= _REPETITIONS_OF_LONG):
                taken.append(_once(entry, count, clock) / (count * entry.units))
    return [
        Record(section, entry.name, {**(case or {}), **entry.case}, unit, clock, taken)
        for entry, taken in zip(contenders, seconds, strict=True)
    ]


def _once(entry: Candidate, calls: int, clock: Clock) -> float:
    """Return the seconds of this many calls."""
    spent = _time(entry.run, calls, clock)
    return spent - (_time(entry.before, calls, clock) if entry.before else 0.0)


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
    """Keep this thread, and those that it starts, on the last ``count`` cores that it may use."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(before)[-count:])
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
