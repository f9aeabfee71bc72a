"""Peer with SciPy's k-d tree: pairs within the range, summed with bincount."""

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.peers.model import Floats, Peer
from benchmarks.peers.numpy_step import Listen, numpy_run


def _listener(num_agents: int, interaction_range: float) -> Listen:
    def listen(positions: Floats, velocities: Floats) -> Floats:
        tree = cKDTree(positions, balanced_tree=False, compact_nodes=False)  # faster to build
        i, j = tree.query_pairs(interaction_range, output_type="ndarray").T
        heard = velocities.copy()
        for axis in range(2):
            heard[:, axis] += np.bincount(i, velocities[j, axis], num_agents)
            heard[:, axis] += np.bincount(j, velocities[i, axis], num_agents)
        return heard

    return listen


PEERS = (Peer("SciPy cKDTree", numpy_run(_listener)),)
