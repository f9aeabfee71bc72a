"""Common interface of the peers: ``Model`` and ``Flocks`` as input, ``Outcome`` as output."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flockesc_env import ConstantVelocity, FlockScenario, simulate

Floats = NDArray[np.float64]


class Model(NamedTuple):
    """Parameters of the flock model for D = 2 and one predator that flies straight on."""

    time_step: float
    mass: float
    speed: float
    predator_range: float
    repulsion_strength: float
    predator_position: tuple[float, float]
    predator_velocity: tuple[float, float]


@dataclass(frozen=True)
class Flocks:
    """Initial states of flocks: positions in m and velocities in m/s, both of shape (flocks, n, 2)."""

    scenario: FlockScenario
    seeds: tuple[int, ...]
    model: Model
    positions: Floats
    velocities: Floats

    @classmethod
    def seeded(cls, scenario: FlockScenario, seeds: range) -> Flocks:
        """Return the initial states of ``sweep`` for some seeds."""
        runs = [simulate(scenario.replace(num_steps=1), 0.0, seed=seed) for seed in seeds]
        (predator,) = (p for p in scenario.predators if isinstance(p, ConstantVelocity))
        (x, y), (vx, vy) = np.array([predator.position, predator.velocity]).tolist()
        model = Model(
            scenario.time_step,
            _shared(scenario.mass),
            _shared(scenario.speed),
            scenario.predator_range,
            _shared(scenario.repulsion_strength),
            (x, y),
            (vx, vy),
        )
        positions = np.stack([run.positions[0] for run in runs])
        velocities = np.stack([run.velocities[0] for run in runs])
        return cls(scenario, tuple(seeds), model, positions, velocities)


def _shared(value: float | tuple[float, ...]) -> float:
    if isinstance(value, tuple):
        raise TypeError("peers need one number for all agents")
    return value


class Outcome(NamedTuple):
    """Positions at the end, shape (flocks, n, 2), and J_mean in m, shape (flocks,)."""

    positions: Floats
    min_mean_distance: Floats


Run = Callable[[Flocks, float, int], Outcome]
"""``run(flocks, interaction_range, steps)``."""


@dataclass(frozen=True)
class Peer:
    """An implementation of the flock model.

    Attributes:
        name: name in tables and figures.
        run: the function to time.
        flocks_at_once: number of flocks per call, for peers that are faster with many; ``None``: ``FLOCKS``.
        is_single: whether it computes in float32.
    """

    name: str
    run: Run
    flocks_at_once: int | None = None
    is_single: bool = False


def one_by_one(run: Callable[[Model, Floats, Floats, float, int], tuple[Floats, float]]) -> Run:
    """Return a ``Run`` that calls an implementation for one flock, shape (n, 2), once per flock."""

    def run_all(flocks: Flocks, interaction_range: float, steps: int) -> Outcome:
        outcomes = [
            run(flocks.model, positions, velocities, interaction_range, steps)
            for positions, velocities in zip(flocks.positions, flocks.velocities, strict=True)
        ]
        return Outcome(np.stack([end for end, _ in outcomes]), np.array([j for _, j in outcomes]))

    return run_all
