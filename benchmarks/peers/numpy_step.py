"""One step of the flock in NumPy around whatever finds the neighbors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.peers.model import Floats, Model, Run, one_by_one

Listen = Callable[[Floats, Floats], Floats]
"""Positions and velocities in; out, for every agent, the sum of the velocities that it hears: (n, 2)."""


def numpy_run(listener: Callable[[int, float], Listen]) -> Run:
    """Return a run that listens with ``listener(n, interaction_range)``."""

    def run(
        model: Model, positions: Floats, velocities: Floats, interaction_range: float, steps: int
    ) -> tuple[Floats, float]:
        listen = listener(len(positions), interaction_range)
        r, v = positions.copy(), velocities.copy()
        predator, predator_velocity = np.array(model.predator_position), np.array(model.predator_velocity)
        offsets = r - predator
        distances = np.sqrt(np.einsum("ij,ij->i", offsets, offsets))
        minimum = distances.mean()
        for _ in range(steps):
            # The direction of a sum is that of the mean.
            force = _scaled(listen(r, v), model.speed)
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
    """Return the vectors of this length in the same directions; 0 where there is none."""
    norms = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    norms[norms == 0.0] = np.inf
    scaled: Floats = vectors * (length / norms)[:, None]
    return scaled
