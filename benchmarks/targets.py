"""What this project wants to reach, and whether a run did; on one core unless a row says otherwise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from benchmarks import PROJECT, grid, kernel, line, size, threads
from benchmarks.measure import Record


class Medians:
    """Looks medians up; what was not measured is not a number, and so is what comes of it."""

    def __init__(self, records: list[Record]) -> None:
        self._records = records

    def get(self, section: str, contender: str = PROJECT, **case: Any) -> float:
        """Return the median in s of the record whose case has exactly these entries."""
        for record in self._records:
            if (record.section, record.contender, record.case) == (section, contender, case):
                return record.median
        return math.nan

    def kernel(self, rho: float, contender: str = PROJECT) -> float:
        """Return the seconds of a step of the paper's flock."""
        return self.get("kernel", contender, rho=rho)

    def least_gain(self, contender: str, least_range: float = 0.0) -> float:
        """Return how many times faster this project is at the range where it gains least."""
        ranges = [rho for rho in kernel.RANGES if rho >= least_range]
        return min(self.kernel(rho, contender) / self.kernel(rho) for rho in ranges)

    def environment(self, interface: str, flocks: int = 1) -> float:
        """Return the seconds of a step of one flock through one of this project's interfaces."""
        name = f"{PROJECT}, {interface}"
        return self.get("environments", name, agents=300, flocks=flocks) / flocks

    def million_agent_steps(self, n: int) -> float:
        """Return millions of agent-steps per second at the paper's density."""
        return n / self.get("size", n=n, rho=size.RANGE) / 1e6

    def dense(self, rho: float) -> float:
        """Return the seconds of a step in the dense crowd."""
        return self.get("size", n=size.DENSE_SIZE, side=size.DENSE_SIDE, rho=rho)

    def grid(self, threads: int) -> float:
        """Return the seconds of the paper's whole grid search."""
        return self.get("grid", ranges=len(grid.RANGES), seeds=len(grid.SEEDS), threads=threads)

    def second_thread(self, contender: str) -> float:
        """Return how many times as much two threads do as one."""
        one, two = (self.get("threads", contender, threads=count) for count in (1, 2))
        return one / two

    def largest(self, threads: int) -> float:
        """Return the seconds of a step of the largest flock, on the wall."""
        return self.get("size", n=size.SIZES[-1], rho=size.RANGE, threads=threads)


@dataclass(frozen=True)
class Target:
    """A figure to reach.

    Attributes:
        what: which figure.
        unit: of target, stretch and figure.
        target: to be reached.
        stretch: better still.
        value: reads the figure off a run.
        at_most: whether small figures are good.
    """

    what: str
    unit: str
    target: float
    stretch: float | None
    value: Callable[[Medians], float]
    at_most: bool = False

    def _reaches(self, figure: float, bound: float | None) -> bool:
        """Return whether a figure is on the right side of a bound; one that is not a number never is."""
        if bound is None:
            return False
        return figure <= bound if self.at_most else figure >= bound

    def verdict(self, medians: Medians) -> str:
        """Return how far a run came."""
        reached = self.value(medians)
        if math.isnan(reached):
            return "not measured"
        if self._reaches(reached, self.stretch):
            return "stretch"
        return "met" if self._reaches(reached, self.target) else "not met"

    def document(self, medians: Medians) -> dict[str, Any]:
        """Return what the JSON file holds."""
        reached = self.value(medians)
        return {
            "what": self.what,
            "unit": self.unit,
            "target": self.bound(self.target),
            "stretch": self.bound(self.stretch),
            "reached": None if math.isnan(reached) else reached,
            "verdict": self.verdict(medians),
        }

    def bound(self, value: float | None) -> str:
        """Return the target or the stretch as text."""
        return "-" if value is None else f"{'<=' if self.at_most else '>='} {value:,g}"


_N = (10_000, 100_000, 1_000_000)

TARGETS = (
    Target(
        "kernel, n = 300, worst range",
        "us",
        11,
        7,
        lambda m: 1e6 * max(m.kernel(rho) for rho in kernel.RANGES),
        at_most=True,
    ),
    Target("kernel, n = 300, 10 m", "us", 8, 5, lambda m: 1e6 * m.kernel(10.0), at_most=True),
    Target("faster than NumPy, all pairs", "x", 250, 400, lambda m: m.least_gain("NumPy, all pairs")),
    Target("faster than NumPy, BLAS", "x", 40, 60, lambda m: m.least_gain("NumPy, BLAS")),
    Target(
        "faster than SciPy cKDTree, 5 m and more", "x", 30, 60, lambda m: m.least_gain("SciPy cKDTree", 5.0)
    ),
    Target(
        "faster than Numba, cell list, 5 m and more",
        "x",
        10,
        15,
        lambda m: m.least_gain("Numba, cell list", 5.0),
    ),
    Target("paper's grid, one core", "s", 9, 6, lambda m: m.grid(1), at_most=True),
    Target("paper's grid, two cores", "s", 5, 3, lambda m: m.grid(2), at_most=True),
    Target(
        "vector environment, 64 flocks, 10 m",
        "flock-steps/s",
        100_000,
        140_000,
        lambda m: 1 / m.environment("Gymnasium vector", 64),
    ),
    Target(
        "vector environment, on top of the kernel",
        "%",
        25,
        None,
        lambda m: 100 * (m.environment("Gymnasium vector", 64) / m.kernel(10.0) - 1),
        at_most=True,
    ),
    Target(
        "Gymnasium step, on top of the kernel",
        "us",
        5,
        2,
        lambda m: 1e6 * (m.environment("Gymnasium") - m.kernel(10.0)),
        at_most=True,
    ),
    Target(f"n = {_N[0]:,}, 10 m", "M agent-steps/s", 30, 45, lambda m: m.million_agent_steps(_N[0])),
    Target(f"n = {_N[1]:,}, 10 m", "M agent-steps/s", 28, 45, lambda m: m.million_agent_steps(_N[1])),
    Target(f"n = {_N[2]:,}, 10 m", "M agent-steps/s", 22, 40, lambda m: m.million_agent_steps(_N[2])),
    Target("dense, n = 100,000, 10 m", "ms", 50, 25, lambda m: 1e3 * m.dense(10.0), at_most=True),
    Target("dense, n = 100,000, 30 m", "ms", 120, 60, lambda m: 1e3 * m.dense(30.0), at_most=True),
    Target(
        "line, n = 100, worst range",
        "us",
        0.5,
        0.2,
        lambda m: 1e6 * max(m.get("line", rho=rho) for rho in line.RANGES),
        at_most=True,
    ),
    Target("two cores, paper's grid", "x", 1.8, None, lambda m: m.grid(1) / m.grid(2)),
    *(
        Target(f"two threads: {name}", "x", 1.7, None, partial(Medians.second_thread, contender=name))
        for name in (threads.OWN_ENVIRONMENTS, threads.OWN_SMALL_ENVIRONMENTS, threads.ONE_BATCH)
    ),
    Target("two cores, one flock of 1,000,000", "x", 1.8, None, lambda m: m.largest(1) / m.largest(2)),
)
