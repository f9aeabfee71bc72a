"""Peer in NumPy: all pairs, written like the equations."""

import numpy as np

from benchmarks.peers.model import Floats, Peer
from benchmarks.peers.numpy_step import Listen, numpy_run


def _listener(_num_agents: int, interaction_range: float) -> Listen:
    def listen(positions: Floats, velocities: Floats) -> Floats:
        distances = np.linalg.norm(positions[:, None] - positions[None, :], axis=-1)
        heard: Floats = (distances <= interaction_range) @ velocities
        return heard

    return listen


PEERS = (Peer("NumPy, all pairs", numpy_run(_listener)),)
