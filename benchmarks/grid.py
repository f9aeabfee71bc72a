"""The paper's grid search through ``sweep``, on one core and on two."""

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
    """Time the whole grid on the wall: what a person waits for."""
    ranges = RANGES[::20] if quick else RANGES
    contenders = [
        Candidate(PROJECT, partial(_search, ranges, threads), 1, case={"threads": threads})
        for threads in (1, 2)
    ]
    case = {"ranges": len(ranges), "seeds": len(SEEDS)}
    return measure("grid", contenders, "grid search", repetitions=3, clock="wall", case=case)


def _search(ranges: Floats, threads: int) -> None:
    with cores(threads):
        sweep(FlockScenario(), ranges, SEEDS, num_threads=threads)
