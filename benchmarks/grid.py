"""Benchmark of the paper's grid search with ``sweep``, on one core and on two."""

from __future__ import annotations

from functools import partial

import numpy as np

from benchmarks import PROJECT
from benchmarks.measure import Candidate, Record, cores, measure
from benchmarks.peers.model import Floats
from flockesc_env import FlockScenario, sweep

RANGES = np.linspace(1.0, 100.0, 100)
SEEDS = range(40)


def run(*, quick: bool) -> list[Record]:
    """Measure the wall-clock time of the whole grid search."""
    ranges = RANGES[::20] if quick else RANGES
    candidates = [
        Candidate(PROJECT, partial(_search, ranges, threads), 1, case={"threads": threads})
        for threads in (1, 2)
    ]
    case = {"ranges": len(ranges), "seeds": len(SEEDS)}
    return measure("grid", candidates, "grid search", repetitions=3, clock="wall", case=case)


def _search(ranges: Floats, threads: int) -> None:
    with cores(threads):
        sweep(FlockScenario(), ranges, SEEDS, num_threads=threads)
