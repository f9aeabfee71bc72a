"""Symmetries and conserved quantities: renumbering, shifting and rotating change no result."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from option_table import small_flock

from flockesc_env import (
    ConstantVelocity,
    FlockEscapeEnv,
    FlockScenario,
    Inertial,
    Intercept,
    LineScenario,
    PurePursuit,
    Reynolds,
    Trajectory,
    Vicsek,
    parallel_env,
    simulate,
    simulate_line,
)

N, STEPS = 12, 6
PER_AGENT = ("mass", "speed", "repulsion_strength", "alignment_strength")
seeds = st.integers(0, 2**32 - 1)
dimensions = st.sampled_from([2, 3])

# No pair of random agents has exactly these distances, so rounding moves no pair across a threshold.
RHO = 7.3
OWN_RHO = np.linspace(1.7, 13.1, N)


def random_flock(dimension: int, rng: np.random.Generator) -> tuple[FlockScenario, np.ndarray, np.ndarray]:
    """Draw a flock of different agents with predators inside it whose targets do not depend on indices."""

    def vector(scale: float) -> np.ndarray:
        return rng.normal(0, scale, dimension)

    scenario = small_flock(
        dimension,
        num_agents=N,
        num_steps=STEPS,
        motion=(Inertial(), Vicsek(), Reynolds(separation_range=4.1))[rng.integers(3)],
        sensing_delay=int(rng.integers(3)),
        **{name: rng.uniform(0.5, 2, N) * getattr(FlockScenario(), name) for name in PER_AGENT},
        predators=(
            ConstantVelocity(vector(10), vector(10)),
            PurePursuit(vector(20), vector(10)),
            PurePursuit(vector(20), vector(10), target="centroid"),
            Intercept(vector(20), vector(10)),
        ),
    )
    return scenario, rng.normal(0, 10, (N, dimension)), rng.normal(0, 10, (N, dimension))


def moved(scenario: FlockScenario, turn: np.ndarray, shift: np.ndarray) -> FlockScenario:
    """Return the scenario with rotated and shifted predators."""
    predators = tuple(
        dataclasses.replace(
            p, position=turn @ np.array(p.position) + shift, velocity=turn @ np.array(p.velocity)
        )
        for p in scenario.predators
    )
    return scenario.replace(predators=predators)


def random_motion(dimension: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw a proper rotation and a shift."""
    turn, _ = np.linalg.qr(rng.normal(size=(dimension, dimension)))
    turn[:, 0] *= np.linalg.det(turn)
    return turn, rng.normal(0, 300, dimension)


def run(scenario: FlockScenario, rho: Any, positions: np.ndarray, velocities: np.ndarray) -> Trajectory:
    return simulate(scenario, rho, initial_positions=positions, initial_velocities=velocities)


def flock_episode(scenario: FlockScenario, start: dict[str, Any], **options: Any) -> list[np.ndarray]:
    env = FlockEscapeEnv(scenario, action_mode="range", **options)
    observations = [env.reset(seed=0, options=start)[0]]
    for _ in range(STEPS):
        observation, reward, *_ = env.step(np.array([RHO], np.float32))
        observations += [observation, np.array([reward])]
    return observations


def agent_episode(scenario: FlockScenario, start: dict[str, Any], rho: np.ndarray, **options: Any):
    env = parallel_env(scenario, action_mode="range", **options)
    observations = [np.stack(list(env.reset(seed=0, options=start)[0].values()))]
    for _ in range(STEPS):
        actions = dict(zip(env.agents, rho[:, None].astype(np.float32), strict=True))
        rows, rewards, *_ = env.step(actions)
        observations += [np.stack(list(rows.values())), np.array(list(rewards.values()))]
    return observations


def assert_close(first: list[np.ndarray], second: list[np.ndarray]) -> None:
    for one, other in zip(first, second, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-5)


@pytest.mark.parametrize("sensing", ["predator_range", None, 5.0])
@settings(max_examples=25)
@given(seeds, dimensions)
def test_observations_do_not_depend_on_place_and_direction(sensing: Any, seed: int, dimension: int) -> None:
    rng = np.random.default_rng(seed)
    scenario, positions, velocities = random_flock(dimension, rng)
    turn, shift = random_motion(dimension, rng)
    start = {"initial_positions": positions, "initial_velocities": velocities}
    turned = {"initial_positions": positions @ turn.T + shift, "initial_velocities": velocities @ turn.T}
    elsewhere = moved(scenario, turn, shift)
    options = {"predator_sensing_range": sensing}
    assert_close(flock_episode(scenario, start, **options), flock_episode(elsewhere, turned, **options))
    options["reward"] = "individual_distance"
    assert_close(
        agent_episode(scenario, start, OWN_RHO, **options),
        agent_episode(elsewhere, turned, OWN_RHO, **options),
    )


@settings(max_examples=60)
@given(seeds, st.integers(1, 60), st.sampled_from([0.0, 0.0213, 0.0871, 0.31, 2.0]))
def test_a_line_without_a_predator_never_expands_or_reunites(seed: int, n: int, rho: float) -> None:
    """Lemma 1: m(t) never falls. Averages stay within the convex hull."""
    trajectory = simulate_line(LineScenario(num_agents=n, predator_position=None), rho, seed=seed)
    assert trajectory.converged
    assert (np.diff(trajectory.num_components) >= 0).all()
    hull = np.stack([trajectory.states.min(axis=1), -trajectory.states.max(axis=1)])
    assert (np.diff(hull, axis=1) >= -1e-15).all()
    order = np.argsort(trajectory.states[0])  # agents never overtake each other
    assert (np.diff(trajectory.states[:, order], axis=1) >= -1e-15).all()
