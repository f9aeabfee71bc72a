"""Peers: other implementations of the flock model, each checked against this project before timing."""

from __future__ import annotations

from importlib import import_module

import numpy as np

from flockesc_env import ConstantVelocity, FlockScenario, Metric, NeighborRule, simulate
from speed.peers.model import Flocks, Peer

_MODULES = ("numpy_flocks", "numba_cells", "jax_all_pairs", "plain_rust")

TOLERANCE = 1e-9
"""Largest allowed difference in m. Sums in another order differ by rounding errors."""
SINGLE_TOLERANCE = 1e-4
"""Largest allowed median difference in m of peers in float32.

Positions up to 128 m have rounding errors of 4e-6 m, and ten steps have a few each. The median is compared
because rounding can move a pair across the range, which turns a few agents.
"""


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
        DisagreementError: if a peer differs by more than its tolerance.
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
            differences = np.abs(
                np.append(outcome.positions - positions, outcome.min_mean_distance - objective)
            )
            largest, tolerance = (np.median, SINGLE_TOLERANCE) if peer.is_single else (np.max, TOLERANCE)
            difference = largest(differences)
            if not difference <= tolerance:
                raise DisagreementError(
                    f"{peer.name} differs by {difference:.3g} m at {interaction_range} {rule.unit}"
                )
