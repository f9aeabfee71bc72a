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
    schedule = np.broadcast_to(schedule, (scenario.num_steps, scenario.num_agents))
    reference.assert_follows(run, schedule, rtol=1e-11, atol=1e-8)


@dimensions
@pytest.mark.parametrize("per_agent", [False, True])
def test_a_radius_without_captures_changes_no_bit(dimension: int, per_agent: bool) -> None:
    free = hunted(dimension, num_agents=200, capture_radius=None)
    rho = np.linspace(0, 15, 200) if per_agent else 7.0
    runs = (fe.simulate(each, rho, seed=2) for each in (free, free.replace(capture_radius=0.0)))
    assert fe.run_differences(*runs) == []


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
