"""Peer in NumPy: all pairs, written like the equations."""

import numpy as np

from benchmarks.peers.model import Floats, Peer
from benchmarks.peers.numpy_step import SumNeighbors, numpy_run


def _make_sum(_num_agents: int, interaction_range: float) -> SumNeighbors:
    def sum_neighbors(positions: Floats, velocities: Floats) -> Floats:
        distances = np.linalg.norm(positions[:, None] - positions[None, :], axis=-1)
        sums: Floats = (distances <= interaction_range) @ velocities
        return sums

    return sum_neighbors


PEERS = (Peer("NumPy, all pairs", numpy_run(_make_sum)),)
