"""Peers in NumPy and SciPy. They share the step of the flock and differ in their neighbor search."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from speed.peers.model import Floats, Model, Peer, one_by_one

SumNeighbors = Callable[[Floats, Floats], Floats]
"""Function of positions and velocities that returns the sum of the neighbors' velocities, shape (n, 2)."""


def _peer(name: str, make_sum: Callable[[int, float], SumNeighbors]) -> Peer:
    """Return a peer with the neighbor search ``make_sum(num_agents, interaction_range)``."""

    def run(
        model: Model, positions: Floats, velocities: Floats, interaction_range: float, steps: int
    ) -> tuple[Floats, float]:
        sum_neighbors = make_sum(len(positions), interaction_range)
        r, v = positions.copy(), velocities.copy()
        predator, predator_velocity = np.array(model.predator_position), np.array(model.predator_velocity)
        offsets = r - predator
        distances = np.sqrt(np.einsum("ij,ij->i", offsets, offsets))
        minimum = distances.mean()
        for _ in range(steps):
            # The sum has the same direction as the mean.
            force = _scaled(sum_neighbors(r, v), model.speed)
            (near,) = np.nonzero(distances <= model.predator_range)
            force[near] += _scaled(offsets[near], model.repulsion_strength)
            r += model.time_step * v
            v += (model.time_step / model.mass) * force
            v = _scaled(v, model.speed)
            predator += model.time_step * predator_velocity
            offsets = r - predator
            distances = np.sqrt(np.einsum("ij,ij->i", offsets, offsets))
            minimum = min(minimum, distances.mean())
        return r, float(minimum)

    return Peer(name, one_by_one(run))


def _scaled(vectors: Floats, length: float) -> Floats:
    """Return the vectors scaled to ``length``; zero vectors stay zero."""
    norms = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    norms[norms == 0.0] = np.inf
    scaled: Floats = vectors * (length / norms)[:, None]
    return scaled


def _all_pairs(_: int, interaction_range: float) -> SumNeighbors:
    """All pairs, written like the equations."""

    def sum_neighbors(positions: Floats, velocities: Floats) -> Floats:
        distances = np.linalg.norm(positions[:, None] - positions[None, :], axis=-1)
        sums: Floats = (distances <= interaction_range) @ velocities
        return sums

    return sum_neighbors


def _blas(num_agents: int, interaction_range: float) -> SumNeighbors:
    """All pairs as matrix products (BLAS) with reused buffers."""
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


def _tree(positions: Floats) -> cKDTree:
    return cKDTree(positions, balanced_tree=False, compact_nodes=False)  # faster to build


def _within_range(num_agents: int, interaction_range: float) -> SumNeighbors:
    def sum_neighbors(positions: Floats, velocities: Floats) -> Floats:
        i, j = _tree(positions).query_pairs(interaction_range, output_type="ndarray").T
        sums = velocities.copy()
        for axis in range(2):
            sums[:, axis] += np.bincount(i, velocities[j, axis], num_agents)
            sums[:, axis] += np.bincount(j, velocities[i, axis], num_agents)
        return sums

    return sum_neighbors


def _nearest(_: int, count: float) -> SumNeighbors:
    def sum_neighbors(positions: Floats, velocities: Floats) -> Floats:
        _, neighbors = _tree(positions).query(positions, int(count) + 1)
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


PEERS = (
    _peer("NumPy, all pairs", _all_pairs),
    _peer("NumPy, BLAS", _blas),
    _peer("SciPy cKDTree", _within_range),
)
NEAREST = _peer("SciPy cKDTree, k nearest", _nearest)
ADJACENT = _peer("SciPy Delaunay", _adjacent)
