"""The models of docs/model.md in plain NumPy: all pairs, one line per equation, no thought for speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from flockesc_env import FlockScenario, Intercept, LineScenario, PurePursuit

Floats = NDArray[np.float64]


@dataclass
class FlockState:
    """Everything that moves: rows are agents or predators."""

    positions: Floats
    velocities: Floats
    predator_positions: Floats
    predator_velocities: Floats
    names: NDArray[np.int64] | None = None
    """Indices at t = 0 of the agents that are left; ``None``: all are."""


def flock_start(scenario: FlockScenario, positions: Floats, velocities: Floats) -> FlockState:
    """Return the state at t = 0; predators given in the plane get z = 0."""

    def rows(vectors: list[tuple[float, ...]]) -> Floats:
        padded = [[*vector, *[0.0] * (scenario.dimension - len(vector))] for vector in vectors]
        return np.array(padded).reshape(-1, scenario.dimension)

    return FlockState(
        positions,
        velocities,
        rows([predator.position for predator in scenario.predators]),
        rows([predator.velocity for predator in scenario.predators]),
    )


def flock_step(scenario: FlockScenario, state: FlockState, ranges: Floats) -> FlockState:
    """Advance one step; ``ranges`` has one entry per agent that is left."""
    r, v = state.positions, state.velocities
    neighbors = directed_graph(r, ranges)
    force = np.zeros_like(v)
    for i in range(len(r)):
        mean = v[neighbors[i]].mean(axis=0)
        if mean.any():
            force[i] += scenario.speed * mean / np.linalg.norm(mean)
        for predator in state.predator_positions:
            distance = np.linalg.norm(r[i] - predator)
            if 0 < distance <= scenario.predator_range:
                force[i] += scenario.repulsion_strength * (r[i] - predator) / distance
    new_r = r + scenario.time_step * v
    new_v = v + scenario.time_step / scenario.mass * force
    if scenario.constant_speed:
        for i in range(len(r)):
            new_v[i] = scenario.speed * new_v[i] / np.linalg.norm(new_v[i]) if new_v[i].any() else v[i]
    new_predators = state.predator_positions + scenario.time_step * state.predator_velocities
    names = np.arange(len(r)) if state.names is None else state.names
    if scenario.capture_radius is not None:
        escapes = predator_distances(new_r, new_predators) > scenario.capture_radius
        new_r, new_v, names = new_r[escapes], new_v[escapes], names[escapes]
    new_predator_v = state.predator_velocities.copy()
    for k, predator in enumerate(scenario.predators if len(new_r) else ()):
        nearest = np.argmin(np.linalg.norm(new_r - new_predators[k], axis=1))
        if isinstance(predator, PurePursuit):
            targets = {
                "nearest": new_r[nearest],
                "centroid": new_r.mean(axis=0),
                "most_isolated": new_r[most_isolated(new_r)],
            }
            limit = predator.max_turn_rate * scenario.time_step
            sight = targets[predator.target] - new_predators[k]
            new_predator_v[k] = turned(new_predator_v[k], sight, limit)
        if isinstance(predator, Intercept):
            offset = new_r[nearest] - new_predators[k]
            rate = sight_rate(offset, new_v[nearest] - new_predator_v[k])
            gain = predator.navigation_constant * scenario.time_step
            limit = predator.max_turn_rate * scenario.time_step
            new_predator_v[k] = navigated(new_predator_v[k], rate, gain, limit)
    return FlockState(new_r, new_v, new_predators, new_predator_v, names)


def turned(velocity: Floats, sight: Floats, limit: float) -> Floats:
    """Turn ``velocity`` toward ``sight`` by at most ``limit`` rad, along the great circle between them."""
    speed, distance = np.linalg.norm(velocity), np.linalg.norm(sight)
    if speed == 0 or distance == 0:
        return velocity
    heading, aim = velocity / speed, sight / distance
    angle = 2 * np.arctan2(np.linalg.norm(heading - aim), np.linalg.norm(heading + aim))
    if angle <= limit:
        return speed * aim
    part = limit / angle
    return speed * (np.sin((1 - part) * angle) * heading + np.sin(part * angle) * aim) / np.sin(angle)


def most_isolated(positions: Floats) -> int:
    """Return the first of the agents whose nearest other agent is farthest."""
    distances = np.linalg.norm(positions[:, None] - positions[None, :], axis=-1)
    np.fill_diagonal(distances, np.inf)
    return int(distances.min(axis=1).argmax())


def sight_rate(offset: Floats, relative_velocity: Floats) -> Floats:
    """Return the angular velocity of a line of sight in rad/s, a vector in space."""
    squared = offset @ offset
    return np.cross(in_space(offset), in_space(relative_velocity)) / squared if squared else np.zeros(3)


def navigated(velocity: Floats, rate: Floats, gain: float, limit: float) -> Floats:
    """Turn ``velocity`` along ``rate`` x velocity by ``gain`` times the angle, at most ``limit`` rad."""
    speed = np.linalg.norm(velocity)
    across = np.cross(rate, in_space(velocity))[: len(velocity)]
    if not across.any():
        return velocity
    angle = min(gain * np.linalg.norm(across) / speed, limit)
    return np.cos(angle) * velocity + np.sin(angle) * speed * across / np.linalg.norm(across)


def in_space(vector: Floats) -> Floats:
    """Return a vector of the plane or of space with three coordinates."""
    return np.append(vector, np.zeros(3 - len(vector)))


def directed_graph(positions: Floats, ranges: Floats) -> NDArray[np.bool]:
    """Return whether agent i (row) listens to agent j (column)."""
    distances = np.linalg.norm(positions[:, None] - positions[None, :], axis=-1)
    return distances <= ranges[:, None]


def num_components(graph: NDArray[np.bool]) -> int:
    """Count the weak components of a directed graph."""
    count, _ = connected_components(graph, directed=True, connection="weak")
    return int(count)


def predator_distances(positions: Floats, predators: Floats) -> Floats:
    """Return every agent's distance to its nearest predator."""
    if not len(predators):
        return np.full(len(positions), np.inf)
    return np.linalg.norm(positions[:, None] - predators[None, :], axis=-1).min(axis=1)


def polarization(velocities: Floats) -> float:
    """Return the norm of the mean heading; an agent at rest has none."""
    speeds = np.linalg.norm(velocities, axis=1, keepdims=True)
    headings = np.divide(velocities, speeds, out=np.zeros_like(velocities), where=speeds > 0)
    return float(np.linalg.norm(headings.mean(axis=0)))


def line_step(scenario: LineScenario, states: Floats, rho: float) -> Floats:
    """Advance the line by one step."""
    neighbors = np.abs(states[:, None] - states[None, :]) <= rho
    moved = (neighbors @ states) / neighbors.sum(axis=1)
    if scenario.predator_position is None:
        return moved
    offset = states - scenario.predator_position
    return moved + np.where(np.abs(offset) < scenario.predator_range, escape_force(scenario, offset), 0.0)


def escape_force(scenario: LineScenario, offset: Floats) -> Floats:
    """Return what the predator adds to agents at ``offset`` = x_i - x_p within its range."""
    s, away = scenario.repulsion_strength, np.sign(offset)
    if scenario.escape_force == "constant":
        return s * away
    if scenario.escape_force == "linear":
        # At x_i = x_p the sign is 0, and so is the rest.
        return s * (-offset + scenario.predator_range * away)
    return -offset + s * scenario.predator_range * away


def line_components(states: Floats, rho: float) -> int:
    """Count the groups of a line whose gaps exceed ``rho``."""
    return 1 + int((np.diff(np.sort(states)) > rho).sum())
