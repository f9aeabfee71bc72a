"""Peer in NumPy, optimized: all pairs as matrix products (BLAS) with reused buffers."""

import numpy as np

from benchmarks.peers.model import Floats, Peer
from benchmarks.peers.numpy_step import SumNeighbors, numpy_run


def _make_sum(num_agents: int, interaction_range: float) -> SumNeighbors:
    # ||r_i - r_j||^2 = (x_i, y_i, q_i, 1) . (-2 x_j, -2 y_j, 1, q_j) with q = ||r||^2.
    left, right = np.ones((num_agents, 4)), np.ones((4, num_agents))
    squared, near = np.empty((num_agents, num_agents)), np.empty((num_agents, num_agents))

    def sum_neighbors(positions: Floats, velocities: Floats) -> Floats:
        centered = positions - positions.mean(axis=0)  # smaller numbers, smaller rounding errors in q
        left[:, :2] = centered
        np.einsum("ij,ij->i", centered, centered, out=left[:, 2])
        np.multiply(centered.T, -2.0, out=right[:2])
        right[3] = left[:, 2]
        np.matmul(left, right, out=squared)
        np.less_equal(squared, interaction_range * interaction_range, out=near)
        np.fill_diagonal(near, 1.0)  # rounding may give a nonzero distance to itself
        return near @ velocities

    return sum_neighbors


PEERS = (Peer("NumPy, BLAS", numpy_run(_make_sum)),)
