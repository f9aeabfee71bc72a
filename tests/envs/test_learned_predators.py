"""Learned predators against plain NumPy: law of motion, observations and rewards."""

from __future__ import annotations

import math
from typing import Any

import learned_reference
import numpy as np
import pytest
import reference
from envs import draw
from hypothesis import given, settings
from hypothesis import strategies as st
from objective_values import COLUMNS
from option_table import AGENT_REWARDS, DIMENSIONS, INDIVIDUAL_REWARDS, OBJECTIVES, small_flock
from reference import FlockState

from flockesc_env import ConstantVelocity, EnvOptions, FlockScenario, Learned, parallel_env, simulate
from flockesc_env.common.errors import ActionError
from flockesc_env.episodes.batch import FlockBatch

dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)

HUNTERS = (
    Learned((-10.0, -5.0), (6.0, 8.0)),
    Learned((40.0, 20.0), (-3.0, 1.0), max_acceleration=60.0, max_speed=7.0),
)


def hunted(dimension: int, hunters: tuple[Learned, ...] = HUNTERS, **changes: Any) -> FlockScenario:
    return small_flock(dimension, num_agents=12, predators=hunters, **changes)


def start_of(scenario: FlockScenario, seed: int) -> FlockState:
    run = simulate(scenario, 0.0, seed=seed)
    return reference.flock_start(scenario, run.positions[0], run.velocities[0])


@dimensions
@settings(max_examples=25)
@given(seed=st.integers(0, 2**32), hold=st.sampled_from([1, 3]))
def test_law_and_observations(dimension: int, seed: int, hold: int) -> None:
    """Each step starts from the engine's state, so differences do not accumulate."""
    scenario = hunted(dimension)
    batch = FlockBatch(scenario, EnvOptions(action_mode="range", steps_per_action=hold))
    batch.reset([0], [seed])
    state, rng = start_of(scenario, seed), np.random.default_rng(seed)
    running = reference.predator_distances(state.positions, state.predator_positions).mean()
    spec = batch.predator_policy_spec
    for step in range(0, 9, hold):
        seen = batch.observe([0], "predators")
        for index, row in enumerate(seen):
            expected = learned_reference.observation(scenario, state, index, step / 10, float(running))
            np.testing.assert_allclose(row, expected, rtol=0, atol=3e-6)
        assert all(spec.layout.space().contains(row) for row in seen)
        actions = rng.uniform(-1, 1, (2, dimension))
        batch.step(np.array([[8.0]]), predator_actions=spec.plain(actions, 2))
        for _ in range(hold):
            state = learned_reference.step(scenario, state, np.full(12, 8.0), actions)
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
    exact, beyond = (simulate(scenario, 9.0, seed=1, predator_actions=ends * by) for by in (1, 1 + 3e-7))
    np.testing.assert_array_equal(exact.predator_positions, beyond.predator_positions)
    spec = FlockBatch(scenario, EnvOptions()).predator_policy_spec
    np.testing.assert_array_equal(spec.plain(ends[0] * (1 + 3e-7), 2), ends[0])
    for refused in (np.nan, 1 + 1e-6):
        with pytest.raises(ActionError, match=r"predator_actions\[1\]"):
            spec.plain([[0.0] * dimension, [refused] * dimension], 2)


@dimensions
def test_without_actions_it_flies_straight_on(dimension: int) -> None:
    kept = ((-10.0, -5.0), (6.0, 8.0))
    learned = simulate(hunted(dimension, (Learned(*kept),)), 9.0, seed=1)
    straight = simulate(hunted(dimension, (ConstantVelocity(*kept),)), 9.0, seed=1)
    np.testing.assert_array_equal(learned.positions, straight.positions)
    np.testing.assert_array_equal(learned.predator_positions, straight.predator_positions)


@dimensions
def test_a_predator_at_rest_faces_the_nearest_agent(dimension: int) -> None:
    scenario = hunted(dimension, (Learned((50.0, -20.0), (0.0, 0.0)),))
    environment = parallel_env(scenario)
    observations, _ = environment.reset(seed=3)
    row = dict(zip(environment.predator_policy_spec.layout.names, observations["predator_0"], strict=True))
    assert row["speed"] == 0
    assert row["nearest_direction_ahead"] == pytest.approx(1.0)
    ahead = np.eye(dimension, dtype=np.float32)[0]
    flock = {agent: environment.action_space(agent).sample() for agent in environment.agents[:-1]}
    environment.step({**flock, "predator_0": ahead})
    state = environment.state()
    velocity = state[-dimension:]
    assert np.linalg.norm(velocity) == pytest.approx(1.0)


@pytest.mark.parametrize("objective", OBJECTIVES)
@pytest.mark.parametrize("reward", AGENT_REWARDS)
@pytest.mark.parametrize("steps_per_action", [1, 4])
def test_predators_get_the_opposite_reward(reward: str, objective: str, steps_per_action: int) -> None:
    environment = parallel_env(
        hunted(2), reward=reward, objective=objective, steps_per_action=steps_per_action
    )
    environment.reset(seed=0)
    total, rng = 0.0, np.random.default_rng(0)
    while environment.agents:
        _, rewards, _, _, infos = environment.step(draw(environment, rng))
        flock = [paid for agent, paid in rewards.items() if agent.startswith("agent")]
        mean = math.fsum(flock) / len(flock) if reward in INDIVIDUAL_REWARDS else flock[0]
        assert rewards["predator_0"] == rewards["predator_1"] == -mean
        assert reward in INDIVIDUAL_REWARDS or set(flock) == {mean}
        total += rewards["predator_0"]
    if reward in {"running_minimum", "terminal"}:
        start = environment.reset(seed=0)[1]["agent_00"]
        name = COLUMNS[objective]
        change = start[name] - infos["agent_00"][name]
        assert total == pytest.approx(change, abs=1e-12)
