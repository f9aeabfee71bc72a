"""Reference implementation of docs/model.md in plain NumPy: all pairs, one line per equation, slow."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import predator_reference
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

import flockesc_env as fe
from flockesc_env.models import Trajectory
from flockesc_env.scenario import FirstOrder, PreferredDistance, Reynolds, Vicsek, Zones

Floats = NDArray[np.float64]


@dataclass
class FlockState:
    """Positions and velocities; rows are agents or predators."""

    positions: Floats
    velocities: Floats
    predator_positions: Floats
    predator_velocities: Floats
    minds: predator_reference.Minds
    names: NDArray[np.int64] | None = None
    """Initial indices of the surviving agents; ``None``: all."""
    heard: list[Floats] = field(default_factory=list)
    """Neighbors' forces of all steps so far."""
    reached: Any = False
    """Whether a predator was in range of an agent before."""


def flock_start(
    scenario: fe.FlockScenario, positions: Floats, velocities: Floats, seed: int = 0
) -> FlockState:
    """Return the state at t = 0; ``seed`` seeds the draws of predators."""
    starts = [predator_reference.start(predator, scenario) for predator in scenario.predators]
    places, speeds = np.reshape(starts, (-1, 2, scenario.dimension)).swapaxes(0, 1)
    draws = predator_reference.Stream(seed, predator_reference.PREDATORS)
    return FlockState(positions, velocities, places, speeds, predator_reference.Minds(draws))


def flock_step(
    scenario: fe.FlockScenario, state: FlockState, ranges: Floats, graph: Any = None
) -> FlockState:
    """Advance one step; ``ranges`` has one entry per surviving agent; ``graph`` says who hears whom."""
    r, v = state.positions, state.velocities
    names = np.arange(len(r)) if state.names is None else state.names
    mass, speed, alignment, repulsion = (
        per_agent(scenario, name)[names]
        for name in ("mass", "speed", "alignment_strength", "repulsion_strength")
    )
    reached = reached_by(scenario, state)
    neighbors = graph_of(scenario, state, ranges) if graph is None else graph
    heard = np.zeros_like(v)
    for i in range(len(r)):
        mean = v[neighbors[i]].mean(axis=0)
        if mean.any():
            heard[i] = alignment[i] * speed[i] * mean / length(mean)
        near = neighbors[i] & (np.arange(len(r)) != i)
        match scenario.motion:
            case Reynolds() as law:
                heard[i] += speed[i] * flocking_force(law, r[i], r[neighbors[i]])
            case PreferredDistance() as law:
                heard[i] += speed[i] * spacing_force(law, r[near] - r[i])
            case Zones() as law:
                heard[i] = alignment[i] * speed[i] * unit(zones_direction(law, r[near] - r[i], v[near]))
            case FirstOrder() as law:
                heard[i] += swarming_velocity(law, r[near] - r[i]) / len(r)
    forces = [*state.heard, heard]
    force = forces[max(0, len(forces) - 1 - scenario.sensing_delay)].copy()
    for i in range(len(r)):
        for predator in state.predator_positions:
            distance = length(r[i] - predator)
            if 0 < distance <= scenario.predator_range:
                power = 2 if isinstance(scenario.motion, FirstOrder) else 1
                force[i] += repulsion[i] * (r[i] - predator) / distance**power
    new_r = r + scenario.time_step * v
    match scenario.motion:
        case Vicsek():
            new_v = force
        case Zones() as law:
            limit = law.max_turn_rate * scenario.time_step
            start = np.where(v.any(axis=1, keepdims=True), v, force)
            turned = [predator_reference.turned(*each, limit) for each in zip(start, force, strict=True)]
            new_v = np.where(force.any(axis=1, keepdims=True), np.reshape(turned, v.shape), 0.0)
        case FirstOrder():
            new_v = force.copy()
            if not scenario.constant_speed:
                new_v *= (speed / np.maximum(np.linalg.norm(force, axis=1), speed))[:, None]
        case _:
            new_v = v + scenario.time_step / mass[:, None] * force
    if scenario.constant_speed:
        for i in range(len(r)):
            new_v[i] = speed[i] * new_v[i] / length(new_v[i]) if new_v[i].any() else v[i]
    if isinstance(scenario.motion, FirstOrder):
        new_r = r + scenario.time_step * new_v
    new_predators = state.predator_positions + scenario.time_step * state.predator_velocities
    if scenario.capture_radius is not None:
        escapes = predator_distances(new_r, new_predators) > scenario.capture_radius
        new_r, new_v, names, reached = new_r[escapes], new_v[escapes], names[escapes], reached[escapes]
        forces = [force[escapes] for force in forces]
    flock = new_r, new_v, names
    steered = predator_reference.steered(
        scenario, flock, new_predators, state.predator_velocities, state.minds
    )
    return FlockState(new_r, new_v, new_predators, steered, state.minds, names, forces, reached)


def assert_follows(run: Trajectory, schedule: Floats, *, rtol: float = 1e-12, atol: float = 1e-9) -> None:
    """Compare a whole run with this model under a schedule of shape (T, n); captures must agree exactly."""
    scenario = run.scenario
    state = flock_start(scenario, run.positions[0].copy(), run.velocities[0].copy(), run.seed or 0)
    agents = np.arange(scenario.num_agents)
    for t in range(scenario.num_steps + 1):
        names = agents if state.names is None else state.names
        is_caught = ~np.isin(agents, names)
        np.testing.assert_array_equal((run.caught_at >= 0) & (run.caught_at <= t), is_caught)
        assert not run.velocities[t, is_caught].any()
        assert run.fraction_surviving[t] == len(names) / len(agents)
        now = schedule[min(t, scenario.num_steps - 1)][names]
        distances = predator_distances(state.positions, state.predator_positions)
        pairs = {
            "positions": (run.positions[t, names], state.positions),
            "velocities": (run.velocities[t, names], state.velocities),
            "predator_positions": (run.predator_positions[t], state.predator_positions),
            "mean_distance": (run.mean_distance[t], distances.mean() if len(names) else 0),
            "min_distance": (run.min_distance[t], distances.min() if len(names) else 0),
            "polarization": (run.polarization[t], polarization(state.velocities) if len(names) else 0),
            "num_components": (run.num_components[t], num_components(graph_of(scenario, state, now))),
        }
        for name, (given, expected) in pairs.items():
            np.testing.assert_allclose(given, expected, rtol, atol, err_msg=f"{name} of step {t}")
        if t < scenario.num_steps:
            state = flock_step(scenario, state, now)


def flocking_force(law: Reynolds, own: Floats, neighbors: Floats) -> Floats:
    """Return cohesion and separation over v0 of an agent at ``own``; ``neighbors`` may include it."""
    distances = np.linalg.norm(own - neighbors, axis=1)
    close = (distances > 0) & (distances <= law.separation_range)
    center = neighbors.mean(axis=0) - own if (distances > 0).any() else np.zeros_like(own)
    apart = ((own - neighbors[close]) / distances[close, None] ** 2).sum(axis=0)
    return law.cohesion_strength * unit(center) + law.separation_strength * unit(apart)


def spacing_force(law: PreferredDistance, offsets: Floats) -> Floats:
    """Return the force over v0 of an agent with other neighbors at ``offsets``."""
    pulls = [np.tanh((length(offset) - law.distance) / law.width) * unit(offset) for offset in offsets]
    return law.strength * np.sum(pulls, axis=0) / max(1, len(pulls))


def zones_direction(law: Zones, offsets: Floats, velocities: Floats) -> Floats:
    """Return the direction that an agent with other neighbors at ``offsets`` wants to fly."""
    away = along = np.zeros(offsets.shape[1])
    for offset, velocity in zip(offsets, velocities, strict=True):
        if length(offset) <= law.repulsion_radius:
            away = away - unit(offset)
        else:
            along = along + unit(velocity if length(offset) <= law.orientation_radius else offset)
    return away if away.any() else along


def swarming_velocity(law: FirstOrder, offsets: Floats) -> Floats:
    """Return n times the velocity of an agent with other neighbors at ``offsets``."""
    apart = offsets[offsets.any(axis=1)]
    return (law.attraction * apart - law.repulsion * apart / (apart**2).sum(axis=1, keepdims=True)).sum(0)


def length(vector: Floats) -> float:
    """Return the bits of ``np.linalg.norm`` of one vector in a third of its time."""
    return math.sqrt(vector @ vector)


def unit(vector: Floats) -> Floats:
    """Return the direction of a vector; 0 for the vector 0."""
    return vector / length(vector) if vector.any() else vector


def per_agent(scenario: fe.FlockScenario, name: str) -> Floats:
    """Return a parameter as one entry per agent, shape (n,)."""
    return np.broadcast_to(np.array(getattr(scenario, name), dtype=float), scenario.num_agents)


def directed_graph(positions: Floats, ranges: Floats) -> NDArray[np.bool]:
    """Return whether agent i (row) hears agent j (column)."""
    return np.linalg.norm(positions[:, None] - positions[None, :], axis=-1) <= ranges[:, None]


def reached_by(scenario: fe.FlockScenario, state: FlockState) -> NDArray[np.bool]:
    """Return whether a predator is, or was, in range of each agent."""
    distances = predator_distances(state.positions, state.predator_positions)
    return np.logical_or(state.reached, distances <= scenario.predator_range)


def graph_of(scenario: fe.FlockScenario, state: FlockState, ranges: Floats) -> NDArray[np.bool]:
    """Return whether agent i (row) hears agent j (column), which may be blocked."""
    reached = reached_by(scenario, state)
    is_blocked = scenario.blocks_warnings & ~reached[:, None] & reached[None, :]
    return directed_graph(state.positions, ranges) & ~is_blocked


def load_of(run: Trajectory) -> tuple[float, float]:
    """Return the mean range, and the mean number of others heard, over steps and agents not caught before."""
    used, heard = [], []
    for t, ranges in enumerate(run.interaction_ranges):
        alive = (run.caught_at < 0) | (run.caught_at > t)
        own = np.broadcast_to(ranges, alive.shape)[alive]
        used.extend(own)
        heard.extend(directed_graph(run.positions[t, alive], own).sum(axis=1) - 1)
    return float(np.mean(used)), float(np.mean(heard))


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
    """Return the norm of the mean heading; an agent at rest counts as 0."""
    speeds = np.linalg.norm(velocities, axis=1, keepdims=True)
    headings = np.divide(velocities, speeds, out=np.zeros_like(velocities), where=speeds > 0)
    return float(np.linalg.norm(headings.mean(axis=0)))


def line_step(scenario: fe.LineScenario, states: Floats, rho: float) -> Floats:
    neighbors = np.abs(states[:, None] - states[None, :]) <= rho
    moved = (neighbors @ states) / neighbors.sum(axis=1)
    if scenario.predator_position is None:
        return moved
    offset = states - scenario.predator_position
    return moved + np.where(np.abs(offset) < scenario.predator_range, escape_force(scenario, offset), 0.0)


def escape_force(scenario: fe.LineScenario, offset: Floats) -> Floats:
    """Return the escape force on agents at ``offset`` = x_i - x_p within the predator's range."""
    s, away = scenario.repulsion_strength, np.sign(offset)
    if scenario.escape_force == "constant":
        return s * away
    if scenario.escape_force == "linear":
        # At x_i = x_p all terms are 0.
        return s * (-offset + scenario.predator_range * away)
    return -offset + s * scenario.predator_range * away


def line_components(states: Floats, rho: float) -> int:
    """Return the number of components of a line: 1 plus the number of gaps above ``rho``."""
    return 1 + int((np.diff(np.sort(states)) > rho).sum())
