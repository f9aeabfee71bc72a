"""Peers: other implementations of the flock model, each checked against this project before timing."""

from __future__ import annotations

from importlib import import_module

import numpy as np

from benchmarks.peers.model import Flocks, Peer
from flockesc_env import ConstantVelocity, FlockScenario, Metric, NeighborRule, simulate

_MODULES = ("numpy_flocks", "numba_cells", "jax_all_pairs", "plain_rust")

TOLERANCE = 1e-9
"""Largest allowed difference in m. Sums in another order differ by rounding errors."""


class DisagreementError(Exception):
    """The results of a peer differ from those of this project."""


def installed() -> list[Peer]:
    """Return the peers whose packages are installed; print which are not."""
    peers: list[Peer] = []
    for name in _MODULES:
        try:
            peers += import_module(f"{__name__}.{name}").PEERS
        except ModuleNotFoundError as error:
            print(f"skipped {name}: {error.name} is not installed")
    return peers


def check(
    peers: list[Peer],
    ranges: tuple[float, ...] = (0.0, 5.0, 10.0, 30.0, 100.0),
    rule: NeighborRule = Metric(),  # noqa: B008, frozen
) -> None:
    """Compare positions and J_mean of the peers with this project after ten steps near the predator.

    Raises:
        DisagreementError: if a peer differs by more than ``TOLERANCE``.
    """
    predator = ConstantVelocity(position=(20.0, 20.0))
    scenario = FlockScenario(num_steps=10, predators=(predator,), neighbor_rule=rule)
    flocks = Flocks.seeded(scenario, range(2))
    for interaction_range in ranges:
        runs = [simulate(scenario, interaction_range, seed=seed) for seed in flocks.seeds]
        positions = np.stack([run.positions[-1] for run in runs])
        objective = np.array([run.mean_distance.min() for run in runs])
        for peer in peers:
            outcome = peer.run(flocks, interaction_range, scenario.num_steps)
            difference = max(
                np.abs(outcome.positions - positions).max(),
                np.abs(outcome.min_mean_distance - objective).max(),
            )
            if not difference <= TOLERANCE:
                raise DisagreementError(
                    f"{peer.name} differs by {difference:.3g} m at {interaction_range} {rule.unit}"
                )
