"""A step of the flock in NumPy, for peers that differ in their neighbor search."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.peers.model import Floats, Model, Run, one_by_one

SumNeighbors = Callable[[Floats, Floats], Floats]
"""Function of positions and velocities that returns the sum of the neighbors' velocities, shape (n, 2)."""


def numpy_run(make_sum: Callable[[int, float], SumNeighbors]) -> Run:
    """Return a ``Run`` with the neighbor search ``make_sum(num_agents, interaction_range)``."""

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

    return one_by_one(run)


def _scaled(vectors: Floats, length: float) -> Floats:
    """Return the vectors scaled to ``length``; zero vectors stay zero."""
    norms = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    norms[norms == 0.0] = np.inf
    scaled: Floats = vectors * (length / norms)[:, None]
    return scaled
