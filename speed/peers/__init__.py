"""Peers: other implementations of the flock model, each checked against this project before timing."""

import subprocess
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.machinery import ExtensionFileLoader, ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from flockesc_env import FlockScenario, simulate
from flockesc_env.scenario import ConstantVelocity, Metric, NeighborRule

_ROOT = Path(__file__).parents[2]
_MODULES = ("numpy_flocks", "numba_cells", "jax_all_pairs")

TOLERANCE = 1e-9  # largest allowed difference in m, of rounding errors of sums in another order
# Positions up to 128 m have rounding errors of 4e-6 m, and ten steps have a few each. The median is compared
# because rounding can move a pair across the range, which turns a few agents.
SINGLE_TOLERANCE = 1e-4  # largest allowed median difference in m of peers in float32
Floats = NDArray[np.float64]


class DisagreementError(Exception):
    """The results of a peer differ from those of this project."""


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
    def seeded(cls, scenario: FlockScenario, seeds: range) -> Self:
        """Return the initial states of ``sweep`` for some seeds."""
        runs = [simulate(scenario.replace(num_steps=1), 0.0, seed=seed) for seed in seeds]
        (predator,) = (p for p in scenario.predators if isinstance(p, ConstantVelocity))
        (x, y), (vx, vy) = np.array([predator.position, predator.velocity]).tolist()
        numbers = {name: getattr(scenario, name) for name in Model._fields[:5]}
        model = Model(**numbers, predator_position=(x, y), predator_velocity=(vx, vy))
        positions = np.stack([run.positions[0] for run in runs])
        velocities = np.stack([run.velocities[0] for run in runs])
        return cls(scenario, tuple(seeds), model, positions, velocities)


class Outcome(NamedTuple):
    """Positions at the end, shape (flocks, n, 2), and J_mean in m, shape (flocks,)."""

    positions: Floats
    min_mean_distance: Floats


Run = Callable[[Flocks, float, int], Outcome]  # ``run(flocks, interaction_range, steps)``
RunOne = Callable[[Model, Floats, Floats, float, int], tuple[Floats, float]]
"""``run(model, positions, velocities, interaction_range, steps)`` for arrays of shape (n, 2)."""


@dataclass(frozen=True)
class Peer:
    """An implementation of the flock model."""

    name: str  # in tables and figures
    run: Run
    flocks_at_once: int | None = None  # per call, for peers that are faster with many; None: ``FLOCKS``
    is_single: bool = False  # whether it computes in float32
    largest: int = 1_000_000  # agents of the largest flock to time; a step of the next size takes seconds


def one_by_one(run: RunOne) -> Run:
    """Return a ``Run`` that calls an implementation for one flock once per flock."""

    def run_all(flocks: Flocks, interaction_range: float, steps: int) -> Outcome:
        outcomes = [
            run(flocks.model, r, v, interaction_range, steps)
            for r, v in zip(flocks.positions, flocks.velocities, strict=True)
        ]
        return Outcome(np.stack([end for end, _ in outcomes]), np.array([j for _, j in outcomes]))

    return run_all


@cache
def rust() -> ModuleType:
    """Compile the crate ``flockesc-peers`` with this project's release profile and import it."""
    command = ["cargo", "build", "--release", "--locked", "--quiet", "--package", "flockesc-peers"]
    subprocess.run(command, cwd=_ROOT, check=True)
    loader = ExtensionFileLoader("flockesc_peers", str(_ROOT / "target/release/libflockesc_peers.so"))
    built = module_from_spec(ModuleSpec(loader.name, loader, origin=loader.path))
    loader.exec_module(built)
    return built


RUST = (Peer("plain Rust, cell list", one_by_one(lambda *args: rust().flock_cells(*args))),)
"""The peer in plain scalar Rust (rust/peers)."""


def installed() -> list[Peer]:
    """Return the peers whose packages are installed; print which are not."""
    peers: list[Peer] = []
    for name in _MODULES:
        try:
            peers += import_module(f"{__name__}.{name}").PEERS
        except ModuleNotFoundError as error:
            print(f"skipped {name}: {error.name} is not installed")
    return [*peers, *RUST]


def check(
    peers: Iterable[Peer],
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
    for rho in ranges:
        runs = [simulate(scenario, rho, seed=seed) for seed in flocks.seeds]
        positions = np.stack([run.positions[-1] for run in runs])
        objective = np.array([run.mean_distance.min() for run in runs])
        for peer in peers:
            end, minimum = peer.run(flocks, rho, scenario.num_steps)
            differences = np.abs(np.append(end - positions, minimum - objective))
            largest, tolerance = (np.median, SINGLE_TOLERANCE) if peer.is_single else (np.max, TOLERANCE)
            difference = largest(differences)
            if not difference <= tolerance:
                at = f"{rho} {scenario.range_unit}"
                raise DisagreementError(f"{peer.name} differs by {difference:.3g} m at {at}")
