"""Peer with SciPy's k-d tree: pairs within the range, summed with bincount."""

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.peers.model import Floats, Peer
from benchmarks.peers.numpy_step import SumNeighbors, numpy_run


def _make_sum(num_agents: int, interaction_range: float) -> SumNeighbors:
    def sum_neighbors(positions: Floats, velocities: Floats) -> Floats:
        tree = cKDTree(positions, balanced_tree=False, compact_nodes=False)  # faster to build
        i, j = tree.query_pairs(interaction_range, output_type="ndarray").T
        sums = velocities.copy()
        for axis in range(2):
            sums[:, axis] += np.bincount(i, velocities[j, axis], num_agents)
            sums[:, axis] += np.bincount(j, velocities[i, axis], num_agents)
        return sums

    return sum_neighbors


PEERS = (Peer("SciPy cKDTree", numpy_run(_make_sum)),)
