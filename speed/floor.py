"""The least time of a step on this machine: arithmetic of small flocks, memory traffic of large ones."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from flockesc_env import FlockScenario, simulate
from speed.flocks import FLOCKS, RANGES
from speed.measure import Candidate, Comparison
from speed.peers.model import Peer

BANDWIDTH, ARITHMETIC = "bandwidth", "arithmetic"

BYTES = 64
"""Bytes that a step must move per agent: position and velocity in f64, read and written, D = 2."""
_PER_NEIGHBOR = 8
"""Operations per neighbor: 2 differences, 2 squares, a sum, a comparison, 2 sums of velocities."""
_PER_AGENT = 35
"""Operations per agent: two norms, three divisions, two forces, the motion, the distance."""


def floor(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Measure the bandwidth of the memory and the peak of f64 arithmetic, and count operations per step."""
    size = 2**20 if quick else 2**24
    source, target = np.ones(size), np.ones(size)
    matrix = np.ones((256, 256) if quick else (1024, 1024))
    copied = partial(np.copyto, target, source)
    yield Comparison([Candidate(BANDWIDTH, copied, 2 * source.nbytes)], "byte")
    multiplied = partial(np.matmul, matrix, matrix)
    for rho in RANGES:
        case = {"rho": rho, "operations": _operations(rho, quick=quick)}
        yield Comparison([Candidate(ARITHMETIC, multiplied, 2 * len(matrix) ** 3)], "operation", case)


def _operations(rho: float, *, quick: bool) -> float:
    """Return the mean number of operations per step of the paper's flock."""
    scenario = FlockScenario(num_steps=24 if quick else 240)
    pairs = [
        cKDTree(positions).count_neighbors(cKDTree(positions), rho)
        for seed in range(FLOCKS)
        for positions in simulate(scenario, rho, seed=seed).positions[:: scenario.num_steps // 12]
    ]
    return float(_PER_NEIGHBOR * np.mean(pairs) + _PER_AGENT * scenario.num_agents)
