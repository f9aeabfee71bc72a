"""Flocks as jobs: attacks from every corner, what turns agents, and objectives of the paper's flock."""

import math
from collections.abc import Iterable
from functools import partial
from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np

from flockesc_env import FlockScenario, simulate
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.jobs import Arrays
from flockesc_env.scenario.options import EnvOptions
from studies.measurements import by_name, over
from studies.scaling.law import STEP, duration

BEGIN, END = 1.0, 6.0  # times in s between which turns are measured and neighbors counted
SECTOR: Final = 0.5  # least cosine between heading and offset of an agent that flies outward
NEAR: Final = 15.0  # in m
EVERY: Final = 4  # steps between two looks at a flock, which raises J_mean by about 0.01 m

Way = tuple[tuple[float, ...], tuple[float, ...]]
"""A predator's path: its direction, with norm sqrt(D), and its offset from the center in L."""


def diagonals(dimension: int) -> list[Way]:
    """Return the ways from all corners through the center."""
    return [(signs, (0.0,) * dimension) for signs in product((1.0, -1.0), repeat=dimension)]


def approaches(dimension: int) -> dict[str, tuple[float, list[Way]]]:
    """Return the predator's speed in v0 and its ways, by approach; only diagonals in three dimensions."""
    ways, speed = diagonals(dimension), math.sqrt(dimension)
    if dimension == 3:
        return {"through the center": (speed, ways)}
    left = math.sqrt(0.5) / 2
    return {
        "through the center": (speed, ways),
        "along the edge": (speed, [((x, y), (-left * y, left * x)) for (x, y), _ in ways]),
        "from a side": (speed, [(((x + y) / speed, (y - x) / speed), at) for (x, y), at in ways]),
        "with half the speed": (speed / 2, ways),
    }


class Flight(NamedTuple):
    """A flock at times t in s: its positions and velocities, shape (times, n, D)."""

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray
    components: int


def fly(scenario: FlockScenario, rho: float, seeds: range, every: int = EVERY) -> list[Flight]:
    """Return the flights of attacked flocks under a range in m, looked at in every few steps."""
    options = EnvOptions(max_range=max(rho, 1.0), steps_per_action=every, count_components=False)
    batch = FlockBatch(scenario, options, num_flocks=len(seeds), num_threads=1)
    batch.reset(range(len(seeds)), list(seeds))
    states = [[batch.core.state(slot) for slot in range(len(seeds))]]
    for _ in range(scenario.num_steps // every):
        batch.step(np.full(len(seeds), float(rho)), are_ranges=True)
        states.append([batch.core.state(slot) for slot in range(len(seeds))])
    times: Any = np.arange(len(states)) * (every * scenario.time_step)
    flights = []
    for slot, number in enumerate(batch.core.num_components()):
        places, velocities = (np.array([row[slot][k] for row in states]) for k in ("positions", "velocities"))
        flights.append(Flight(times, places, velocities, int(number)))
    return flights


def attacks(
    scenario: FlockScenario, ranges: tuple[float, ...], speeds: tuple[float, ...], seeds: range
) -> Arrays:
    """Return J_mean in L, ``reached``, and the components at the end.

    The shapes are (ranges, seeds, speeds) and (ranges, seeds). Ranges are in L, the predator's speeds in v0.
    A flock that does not flee is attacked from every corner, which changes no path; values are means over the
    corners.
    """
    ways, side = diagonals(scenario.dimension), scenario.initial_side
    if scenario.repulsion_strength != 0:
        ways = ways[:1]
    flights = [fly(scenario, rho * side, seeds) for rho in ranges]
    return {
        "reached": np.array(
            [[[closest(one, side, speed, ways) for speed in speeds] for one in row] for row in flights]
        ),
        "components": np.array([[one.components for one in row] for row in flights]),
    }


def closest(flight: Flight, side: float, speed: float, ways: Iterable[Way]) -> float:
    """Return J_mean in L, the mean over attacks on some ways."""
    dimension = flight.positions.shape[2]
    times = flight.times * float(np.linalg.norm(flight.velocities[0, 0])) / side
    times = times[times <= duration(dimension, speed) + STEP / 2]
    along = side * (speed * times / dimension**0.5 - 0.8)
    smallest = []
    for direction, offset in ways:
        paths = [side / 2 + c * along + side * o for c, o in zip(direction, offset, strict=True)]
        squares = sum(
            (flight.positions[: len(times), :, k] - path[:, None]) ** 2 for k, path in enumerate(paths)
        )
        smallest.append(np.sqrt(squares).mean(axis=1).min())
    return float(np.mean(smallest)) / side


def turns(scenario: FlockScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return what turns the agents of flocks that do not flee, shape (ranges, seeds); ranges are in L.

    - J_mean in L for each of ``approaches``, as ``attacks``;
    - ``correlation``: of the agents' displacements until ``END`` with their initial offsets from the center;
    - ``outward turn`` and ``inward turn``: mean angle in degrees between the headings at ``BEGIN`` and
      ``END`` of agents that fly within 60 degrees of the outward or inward direction at ``BEGIN``;
    - ``outward met`` and ``inward met``: the number of others that these agents hear in this time, at one
      look or more, and did not hear at ``BEGIN``.

    In three dimensions there is no turn and no ``met``.
    """
    return over(partial(_turns_of, scenario), (rho * scenario.initial_side for rho in ranges), seeds)


def _turns_of(scenario: FlockScenario, rho: float, seed: int) -> dict[str, float]:
    run, side = simulate(scenario, rho, seed=seed), scenario.periodic_side
    moved = np.diff(run.positions, axis=0)
    if side is not None:
        moved -= side * np.rint(moved / side)
    paths = run.positions[0] + np.concatenate([np.zeros_like(moved[:1]), moved.cumsum(axis=0)])
    flight = Flight(run.times[::EVERY], paths[::EVERY], run.velocities[::EVERY], int(run.num_components[-1]))
    flown, headings = flight.positions, flight.velocities / scenario.speed
    begin, end = (int(flight.times.searchsorted(time - STEP)) for time in (BEGIN, END))
    offsets, moved = (part - part.mean(axis=0) for part in (flown[0], flown[end] - flown[0]))
    radial = flown[begin] - flown[begin].mean(axis=0)
    cosine = (headings[begin] * radial).sum(axis=1) / np.linalg.norm(radial, axis=1)
    turned = np.degrees(np.arccos((headings[begin] * headings[end]).sum(axis=1).clip(-1, 1)))
    apart = flown[begin : end + 1, :, None] - flown[begin : end + 1, None]
    if side is not None:
        apart -= side * np.rint(apart / side)
    heard = (apart**2).sum(axis=3) <= rho**2
    met = (heard.any(axis=0) & ~heard[0]).sum(axis=1)
    scale = np.sqrt((offsets**2).sum() * (moved**2).sum())
    found = {
        name: closest(flight, scenario.initial_side, speed, ways)
        for name, (speed, ways) in approaches(scenario.dimension).items()
    }
    found["correlation"] = float((offsets * moved).sum() / scale)
    if scenario.dimension == 3:  # in some flocks nobody flies inward
        return found
    for name, who in {"outward": cosine > SECTOR, "inward": cosine < -SECTOR}.items():
        found |= {f"{name} turn": float(turned[who].mean()), f"{name} met": float(met[who].mean())}
    return found


def objectives(scenario: FlockScenario, ranges: tuple[float, ...], seeds: range) -> Arrays:
    """Return objectives of flocks under the paper's attack, shape (ranges, seeds); ranges are in m."""
    longer = scenario.replace(num_steps=2 * scenario.num_steps)
    return by_name(
        [by_name([_objectives_of(one) for one in fly(longer, rho, seeds, every=1)]) for rho in ranges]
    )


def _objectives_of(flight: Flight) -> dict[str, float]:
    predator = 10 * flight.times[:, None, None] - 30
    every = np.linalg.norm(flight.positions - predator, axis=2)
    distances = every[: len(every) // 2 + 1]
    nearest, tenth = distances.min(axis=0), distances.shape[1] // 10
    values = {
        "J_mean, 12 s": distances.mean(axis=1).min(),
        "J_mean, 24 s": every.mean(axis=1).min(),
        "mean distance over 12 s": distances.mean(),
        "mean distance at 12 s": distances[-1].mean(),
        "mean nearest distance": nearest.mean(),
        f"share never within {NEAR:g} m": (nearest > NEAR).mean(),
        "J of the nearest tenth": np.partition(distances, tenth, axis=1)[:, :tenth].mean(axis=1).min(),
        "J_min": nearest.min(),
    }
    return {name: float(value) for name, value in values.items()}
