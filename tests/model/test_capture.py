"""Captures: the NumPy model determines which agents are caught and when."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
import reference
from captured_flocks import SIDE, hunted
from hypothesis import given, settings
from hypothesis import strategies as st
from option_table import DIMENSIONS

import flockesc_env as fe
from flockesc_env.scenario.predators import Target

dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)


@st.composite
def capturing_scenarios(draw: st.DrawFn) -> fe.FlockScenario:
    dimension = draw(st.sampled_from(DIMENSIONS))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))

    def predator(kind: str) -> Any:
        position, velocity = rng.uniform(0, SIDE, dimension), rng.normal(0, 15, dimension)
        if kind == "straight":
            return fe.ConstantVelocity(position, velocity)
        if kind == "intercept":
            return fe.Intercept(position, velocity, max_turn_rate=3.0)
        return fe.PurePursuit(
            position, velocity, max_turn_rate=3.0, target=draw(st.sampled_from(get_args(Target)))
        )

    kinds = st.lists(st.sampled_from(["straight", "pursuit", "intercept"]), min_size=1, max_size=3)
    return fe.FlockScenario(
        num_agents=draw(st.integers(1, 80)),
        dimension=dimension,
        num_steps=12,
        initial_side=SIDE,
        capture_radius=draw(st.sampled_from([0.5, 2.0, 5.0])),
        constant_speed=draw(st.booleans()),
        predators=tuple(predator(kind) for kind in draw(kinds)),
    )


@settings(max_examples=80)
@given(capturing_scenarios(), st.integers(0, 2**32 - 1), st.booleans())
def test_captures_follow_the_numpy_model(scenario: fe.FlockScenario, seed: int, per_agent: bool) -> None:
    rng = np.random.default_rng(seed)
    columns = scenario.num_agents if per_agent else 1
    schedule = rng.uniform(0, SIDE, (scenario.num_steps, columns))
    run = fe.simulate(scenario, schedule=schedule, seed=seed)
    state = reference.flock_start(scenario, run.positions[0].copy(), run.velocities[0].copy())
    names = np.arange(scenario.num_agents)
    close = {"rtol": 1e-11, "atol": 1e-8}
    predators, summaries = [], []
    for t in range(scenario.num_steps + 1):
        is_caught = np.isin(np.arange(scenario.num_agents), names, invert=True)
        np.testing.assert_array_equal((run.caught_at >= 0) & (run.caught_at <= t), is_caught)
        np.testing.assert_allclose(run.positions[t, names], state.positions, **close, err_msg=f"step {t}")
        np.testing.assert_allclose(run.velocities[t, names], state.velocities, **close, err_msg=f"step {t}")
        assert not run.velocities[t, is_caught].any()
        assert run.fraction_surviving[t] == len(names) / scenario.num_agents
        predators.append(state.predator_positions)
        now = np.broadcast_to(schedule[min(t, scenario.num_steps - 1)], scenario.num_agents)[names]
        if len(names):
            distances = reference.predator_distances(state.positions, state.predator_positions)
            num_components = reference.num_components(reference.directed_graph(state.positions, now))
            polarization = reference.polarization(state.velocities)
            summaries.append((distances.mean(), distances.min(), polarization, num_components))
        else:
            assert run.mean_distance[t] == run.min_distance[t] == run.polarization[t] == 0
            assert run.num_components[t] == 0
            summaries.append((0, 0, 0, 0))
        if t < scenario.num_steps:
            state = reference.flock_step(scenario, state, now)
            names = state.names
    np.testing.assert_allclose(run.predator_positions, predators, **close)
    found = (run.mean_distance, run.min_distance, run.polarization, run.num_components)
    np.testing.assert_allclose(np.stack(found, axis=1), summaries, **close)


def assert_equal(first: fe.Trajectory, second: fe.Trajectory) -> None:
    assert fe.run_differences(first, second) == []


@dimensions
@pytest.mark.parametrize("per_agent", [False, True])
def test_a_radius_without_captures_changes_no_bit(dimension: int, per_agent: bool) -> None:
    free = hunted(dimension, num_agents=200, capture_radius=None)
    rho = np.linspace(0, 15, 200) if per_agent else 7.0
    assert_equal(fe.simulate(free, rho, seed=2), fe.simulate(free.replace(capture_radius=0.0), rho, seed=2))


def test_a_capture_can_raise_the_mean_distance_but_not_its_running_minimum() -> None:
    scenario = fe.FlockScenario(
        num_agents=2, num_steps=1, capture_radius=1.0, predators=(fe.ConstantVelocity((0, 0), (0, 0)),)
    )
    start = {"initial_positions": [[0.5, 0.0], [50.0, 0.0]], "initial_velocities": np.zeros((2, 2))}
    env = fe.FlockEscapeEnv(scenario)
    _, before = env.reset(options=start)
    _, reward, terminated, truncated, after = env.step(env.action_space.sample())
    assert before["mean_distance"] == 25.25
    assert after["mean_distance"] > 49
    assert after["min_mean_distance"] == 25.25
    assert (reward, terminated, truncated, after["fraction_surviving"]) == (0.0, False, True, 0.5)
