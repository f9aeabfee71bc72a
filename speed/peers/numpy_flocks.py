"""Peers in NumPy and SciPy. They share the step of the flock and differ in their neighbor search."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from speed.peers import Floats, Model, Peer, Run, one_by_one

SumNeighbors = Callable[[Floats, Floats, float], Floats]
"""``sum_neighbors(positions, velocities, range)`` returns sums of the neighbors' velocities, shape (n, 2)."""


def _run(make_sum: Callable[[int], SumNeighbors]) -> Run:
    """Return a run with the neighbor search ``make_sum(num_agents)``."""

    def run(model: Model, r: Floats, v: Floats, rho: float, steps: int) -> tuple[Floats, float]:
        sum_neighbors = make_sum(len(r))
        r, v = r.copy(), v.copy()
        predator, predator_velocity = np.array(model.predator_position), np.array(model.predator_velocity)
        offsets = r - predator
        distances = np.sqrt(np.einsum("ij,ij->i", offsets, offsets))
        minimum = distances.mean()
        for _ in range(steps):
            # The sum has the same direction as the mean.
            force = _scaled(sum_neighbors(r, v, rho), model.speed)
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

    return one_by_one(run)


def _scaled(vectors: Floats, length: float) -> Floats:
    """Return the vectors scaled to ``length``; zero vectors stay zero."""
    norms = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    norms[norms == 0.0] = np.inf
    scaled: Floats = vectors * (length / norms)[:, None]
    return scaled


def _all_pairs(positions: Floats, velocities: Floats, interaction_range: float) -> Floats:
    """All pairs, written like the equations."""
    distances = np.linalg.norm(positions[:, None] - positions[None, :], axis=-1)
    sums: Floats = (distances <= interaction_range) @ velocities
    return sums


def _blas(num_agents: int) -> SumNeighbors:
    """All pairs as matrix products (BLAS) with reused buffers."""
    # ||r_i - r_j||^2 = (x_i, y_i, q_i, 1) . (-2 x_j, -2 y_j, 1, q_j) with q = ||r||^2.
    left, right = np.ones((num_agents, 4)), np.ones((4, num_agents))
    squared, near = np.empty((num_agents, num_agents)), np.empty((num_agents, num_agents))

    def sum_neighbors(positions: Floats, velocities: Floats, interaction_range: float) -> Floats:
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


def _within_range(positions: Floats, velocities: Floats, interaction_range: float) -> Floats:
    i, j = _tree(positions).query_pairs(interaction_range, output_type="ndarray").T
    sums = velocities.copy()
    for axis in range(2):
        sums[:, axis] += np.bincount(i, velocities[j, axis], len(positions))
        sums[:, axis] += np.bincount(j, velocities[i, axis], len(positions))
    return sums


def _nearest(positions: Floats, velocities: Floats, count: float) -> Floats:
    _, neighbors = _tree(positions).query(positions, int(count) + 1)
    sums: Floats = velocities[neighbors].sum(axis=1)
    return sums


def _adjacent(positions: Floats, velocities: Floats, interaction_range: float) -> Floats:
    starts, others = Delaunay(positions).vertex_neighbor_vertices
    listeners = np.repeat(np.arange(len(positions)), np.diff(starts))
    offsets = positions[listeners] - positions[others]
    near = np.einsum("ij,ij->i", offsets, offsets) <= interaction_range**2
    sums = velocities.copy()
    for axis in range(2):
        sums[:, axis] += np.bincount(listeners[near], velocities[others[near], axis], len(positions))
    return sums


PEERS = (
    Peer("NumPy, all pairs", _run(lambda _: _all_pairs), largest=3_000),
    Peer("NumPy, BLAS", _run(_blas), largest=10_000),
    Peer("SciPy cKDTree", _run(lambda _: _within_range)),
)
NEAREST = Peer("SciPy cKDTree, k nearest", _run(lambda _: _nearest))
ADJACENT = Peer("SciPy Delaunay", _run(lambda _: _adjacent))
