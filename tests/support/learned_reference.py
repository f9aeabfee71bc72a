"""Learned predators in plain NumPy: frame, law of motion and observation of docs/model.md."""

from __future__ import annotations

import numpy as np
import observation_reference
import reference
from observation_reference import squash
from reference import Floats, FlockState, unit

from flockesc_env import FlockScenario, Learned


def vectors(state: FlockState, index: int) -> dict[str, Floats]:
    """Return all vectors that predator ``index`` sees, in m and m/s; 0 if an agent or predator is missing."""
    position, velocity = state.predator_positions[index], state.predator_velocities[index]
    nearest = np.argmin(np.linalg.norm(state.positions - position, axis=1))
    others = np.delete(state.predator_positions, index, axis=0) - position
    has_other = len(others) > 0
    return {
        "nearest": state.positions[nearest] - position,
        "nearest_velocity": state.velocities[nearest] - velocity,
        "centroid": state.positions.mean(axis=0) - position,
        "flock_velocity": state.velocities.mean(axis=0) - velocity,
        "other": others[np.argmin(np.linalg.norm(others, axis=1))] if has_other else np.zeros_like(position),
    }


def frame(state: FlockState, index: int) -> Floats:
    """Return the axes ahead, left(, up): ahead is the heading, left the side of the nearest agent."""
    cues = list(vectors(state, index).values())
    velocity = state.predator_velocities[index]
    ahead = velocity if velocity.any() else next(cue for cue in cues if cue.any())
    return np.array(observation_reference.frame(ahead, cues))


def step(scenario: FlockScenario, state: FlockState, ranges: Floats, actions: Floats) -> FlockState:
    """Advance one step; ``actions`` has a row per predator, and all predators are learned."""
    after = reference.flock_step(scenario, state, ranges)
    for index, (predator, action) in enumerate(zip(scenario.predators, actions, strict=True)):
        assert isinstance(predator, Learned)
        strength = action / max(np.linalg.norm(action), 1.0)
        acceleration = predator.max_acceleration * strength @ frame(state, index)
        velocity = state.predator_velocities[index] + scenario.time_step * acceleration
        speed = np.linalg.norm(velocity)
        after.predator_velocities[index] = velocity * min(1.0, predator.max_speed / max(speed, 1e-300))
    return after


def observation(
    scenario: FlockScenario, state: FlockState, index: int, time: float, running_minimum: float
) -> Floats:
    """Return the row of predator ``index``, entry by entry."""
    predator = scenario.predators[index]
    assert isinstance(predator, Learned)
    axes, seen = frame(state, index), vectors(state, index)
    length, speed = scenario.initial_side, scenario.speed

    def direction(name: str) -> Floats:
        return axes @ unit(seen[name])

    def velocity(name: str) -> Floats:
        return axes @ seen[name] / (np.linalg.norm(seen[name]) + speed)

    def distance(name: str) -> float:
        return squash(float(np.linalg.norm(seen[name])), length)

    position = state.predator_positions[index]
    distances = np.linalg.norm(state.positions - position, axis=1)
    spread = np.sqrt(((state.positions - state.positions.mean(axis=0)) ** 2).sum(axis=1).mean())
    own_speed = float(np.linalg.norm(state.predator_velocities[index]))
    row: list[Floats | float] = [
        time,
        squash(running_minimum, length),
        min(own_speed / predator.max_speed, 1.0),
        direction("nearest"),
        distance("nearest"),
        velocity("nearest_velocity"),
        direction("centroid"),
        distance("centroid"),
        velocity("flock_velocity"),
        squash(float(spread), length),
        reference.polarization(state.velocities),
        float((distances <= scenario.predator_range).mean()),
        float(len(scenario.predators) > 1),
        direction("other"),
        distance("other"),
    ]
    return np.concatenate([np.atleast_1d(part) for part in row])
