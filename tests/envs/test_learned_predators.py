"""Learned predators against plain NumPy: law of motion, observations and rewards."""

from typing import Any

import numpy as np
import pytest
import reference
from hypothesis import given, settings
from hypothesis import strategies as st
from observation_reference import frame as view_frame
from observation_reference import squash
from option_table import DIMENSIONS, small_flock
from reference import Floats, FlockState, unit

from flockesc_env import EnvOptions, FlockScenario
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.models.simulate import run_flock
from flockesc_env.scenario import Learned

dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)

HUNTERS = (
    Learned((-10.0, -5.0), (6.0, 8.0)),
    Learned((40.0, 20.0), (-3.0, 1.0), max_acceleration=60.0, max_speed=7.0),
)


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
    return np.array(view_frame(ahead, cues))


def flock_step(scenario: FlockScenario, state: FlockState, ranges: Floats, actions: Floats) -> FlockState:
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


def hunted(dimension: int, hunters: tuple[Learned, ...] = HUNTERS, **changes: Any) -> FlockScenario:
    return small_flock(dimension, num_agents=12, predators=hunters, **changes)


def start_of(scenario: FlockScenario, seed: int) -> FlockState:
    run = run_flock(scenario, 0.0, seed=seed)
    return reference.flock_start(scenario, run.positions[0], run.velocities[0])


@dimensions
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32), hold=st.sampled_from([1, 3]), at_rest=st.booleans())
def test_law_and_observations(dimension: int, seed: int, hold: int, at_rest: bool) -> None:
    """Each step starts from the engine's state, so differences do not accumulate."""
    scenario = hunted(dimension, (HUNTERS[0], Learned((50.0, -20.0), (0.0, 0.0))) if at_rest else HUNTERS)
    batch = FlockBatch(scenario, EnvOptions(action_mode="range", steps_per_action=hold))
    batch.reset([0], [seed])
    state, rng = start_of(scenario, seed), np.random.default_rng(seed)
    running = reference.predator_distances(state.positions, state.predator_positions).mean()
    spec = batch.predator_policy_spec
    for step in range(0, 9, hold):
        seen = batch.observe([0], "predators")
        for index, row in enumerate(seen):
            expected = observation(scenario, state, index, step / 10, float(running))
            np.testing.assert_allclose(row, expected, rtol=0, atol=3e-6)
        assert all(spec.layout.space().contains(row) for row in seen)
        actions = rng.uniform(-1, 1, (2, dimension))
        batch.step(np.array([[8.0]]), predator_actions=spec.plain(actions, 2))
        for _ in range(hold):
            state = flock_step(scenario, state, np.full(12, 8.0), actions)
            distances = reference.predator_distances(state.positions, state.predator_positions)
            running = min(running, distances.mean())
        now = batch.state(0)
        for name in ("positions", "velocities", "predator_positions", "predator_velocities"):
            np.testing.assert_allclose(now[name], getattr(state, name), rtol=0, atol=1e-8)
            setattr(state, name, now[name])


@dimensions
def test_rounding_in_float32_is_clipped(dimension: int) -> None:
    scenario = hunted(dimension)
    ends = np.resize([1.0, 0.0, -1.0, 1.0, 0.0], (scenario.num_steps, 2, dimension))
    exact, beyond = (run_flock(scenario, 9.0, seed=1, predator_actions=ends * by) for by in (1, 1 + 3e-7))
    np.testing.assert_array_equal(exact.predator_positions, beyond.predator_positions)
    spec = FlockBatch(scenario, EnvOptions()).predator_policy_spec
    np.testing.assert_array_equal(spec.plain(ends[0] * (1 + 3e-7), 2), ends[0])
    for refused in (np.nan, 1 + 1e-6):
        with pytest.raises(InputError, match=r"predator_actions\[1\]"):
            spec.plain([[0.0] * dimension, [refused] * dimension], 2)
