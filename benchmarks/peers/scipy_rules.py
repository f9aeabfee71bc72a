"""Peers with SciPy for other neighbor rules: k nearest (k-d tree) and Voronoi (Delaunay)."""

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from benchmarks.peers.model import Floats, Peer
from benchmarks.peers.numpy_step import SumNeighbors, numpy_run


def _nearest(_: int, count: float) -> SumNeighbors:
    def sum_neighbors(positions: Floats, velocities: Floats) -> Floats:
        tree = cKDTree(positions, balanced_tree=False, compact_nodes=False)  # faster to build
        _, neighbors = tree.query(positions, int(count) + 1)
        sums: Floats = velocities[neighbors].sum(axis=1)
        return sums

    return sum_neighbors


def _adjacent(num_agents: int, interaction_range: float) -> SumNeighbors:
    def sum_neighbors(positions: Floats, velocities: Floats) -> Floats:
        starts, others = Delaunay(positions).vertex_neighbor_vertices
        listeners = np.repeat(np.arange(num_agents), np.diff(starts))
        offsets = positions[listeners] - positions[others]
        near = np.einsum("ij,ij->i", offsets, offsets) <= interaction_range**2
        sums = velocities.copy()
        for axis in range(2):
            sums[:, axis] += np.bincount(listeners[near], velocities[others[near], axis], num_agents)
        return sums

    return sum_neighbors


NEAREST = Peer("SciPy cKDTree, k nearest", numpy_run(_nearest))
ADJACENT = Peer("SciPy Delaunay", numpy_run(_adjacent))
