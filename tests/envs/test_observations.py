"""Every observation entry against its definition in docs/model.md, in plain NumPy."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import reference
from hypothesis import given, settings
from hypothesis import strategies as st
from observation_reference import Reference
from option_table import DIMENSIONS, EVERY_STEP, OBJECTIVES

import flockesc_env as fe
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.scenario import ConstantVelocity, Learned, PurePursuit, Reynolds, Topological, Voronoi
from flockesc_env.scenario.predators import Start

STEPS = 4
RANGES = (0.0, 9.0, 40.0)
ENTRIES = ("escape_direction", "closest_approach")


@st.composite
def flocks(draw: st.DrawFn) -> tuple[fe.FlockScenario, fe.EnvOptions, np.random.Generator]:
    dimension = draw(st.sampled_from(DIMENSIONS))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))

    def predator(kind: type[Start]) -> Start:
        return kind(rng.normal(0, 30, dimension), rng.normal(0, draw(st.sampled_from([0, 12])), dimension))

    kinds = st.lists(st.sampled_from([ConstantVelocity, PurePursuit, Learned]), min_size=1, max_size=3)
    scenario = fe.FlockScenario(
        num_agents=draw(st.sampled_from([1, 2, 7, 8, 9, 60, 64, 65, 130])),
        dimension=dimension,
        num_steps=STEPS,
        initial_side=draw(st.sampled_from([20.0, 100.0])),
        predator_range=draw(st.sampled_from([0.0, 20.0])),
        constant_speed=draw(st.booleans()),
        capture_radius=draw(st.sampled_from([None, None, 3.0, 15.0])),
        predators=tuple(predator(kind) for kind in draw(kinds)),
    )
    options = fe.EnvOptions(
        action_mode="range",
        max_range=100.0,
        steps_per_action=1,
        objective=draw(st.sampled_from(OBJECTIVES)),
        predator_sensing_range=draw(st.sampled_from([scenario.predator_range, math.inf, 35.0])),
    )
    return scenario, options, rng


def random_start(scenario: fe.FlockScenario, rng: np.random.Generator) -> reference.FlockState:
    """Draw a flock, sometimes elongated and sometimes far from the origin."""
    shape = (scenario.num_agents, scenario.dimension)
    extents = rng.choice([0.1, 5.0, 30.0], scenario.dimension)
    positions = rng.normal(0, extents, shape) + rng.choice([-100.0, 0.0])
    velocities = rng.normal(0, rng.choice([1.0, 10.0]), shape)
    return reference.flock_start(scenario, positions, velocities)


def assert_observed(rows: np.ndarray, layout: Any, expected: list[dict[str, float]]) -> None:
    """Compare observations; entries that a row does not have are zero."""
    for index, name in enumerate(layout.names):
        column = [row.get(name, 0.0) for row in expected]
        np.testing.assert_allclose(rows[:, index], column, rtol=0, atol=1e-6, err_msg=name)


def assert_plays_as(flock: Reference, rng: np.random.Generator, *, per_agent: bool) -> None:
    """Compare the states, and the observations of the flock or its agents and of learned predators."""
    batch = FlockBatch(flock.scenario, flock.options, per_agent=per_agent)
    state, spec = flock.state, batch.predator_policy_spec
    start = {"initial_positions": state.positions, "initial_velocities": state.velocities}
    rows, _ = batch.reset([0], [0], [start])
    view = flock.agent_view if per_agent else flock.flock_view
    for step in range(STEPS + 1):
        assert_observed(rows, batch.policy_spec.layout, view())
        if not len(flock.names):
            return
        if flock.learned:
            seen = batch.core.observe([0], "predators")
            expected = [flock.predator_row(index) for index in flock.learned]
            np.testing.assert_allclose(seen, expected, rtol=0, atol=3e-6)
            assert all(spec.layout.space().contains(row) for row in seen)
        for name in ("positions", "velocities", "predator_positions", "predator_velocities"):
            now = batch.core.state(0)[name]
            now = now if "predator" in name else now[flock.names]
            np.testing.assert_allclose(now, getattr(flock.state, name), rtol=0, atol=1e-8)
        if step < STEPS:
            choices = [np.zeros(batch.rows), rng.uniform(0, 50, batch.rows), np.full(batch.rows, 100.0)]
            actions = choices[rng.integers(3)].astype(np.float32)
            pushes = rng.uniform(-1, 1, (spec.count, flock.scenario.dimension))
            controls = spec.plain(pushes, spec.count) if spec.count else None
            rows = batch.step(actions[:, None], predator_actions=controls)[0]
            flock.step(np.broadcast_to(actions.astype(float), flock.scenario.num_agents), pushes)


@pytest.mark.parametrize("per_agent", [False, True])
@settings(max_examples=40)
@given(case=flocks(), has_all=st.booleans())
def test_entries(
    case: tuple[fe.FlockScenario, fe.EnvOptions, np.random.Generator], has_all: bool, *, per_agent: bool
) -> None:
    scenario, options, rng = case
    if has_all:
        options = dataclasses.replace(
            options, profile_ranges=RANGES if per_agent else None, extra_entries=ENTRIES
        )
    state = random_start(scenario, rng)
    agent, chance = rng.integers(scenario.num_agents), rng.random()
    if not per_agent and chance < 0.5:
        state.velocities[agent] = 0.0
    elif not per_agent and chance < 0.7 and scenario.num_agents > 1:
        # A single predator exactly at the centroid has no direction from it, but rounding would give it one.
        # An agent without a velocity would be exactly behind the predator, which can turn either way.
        state.positions[agent] = state.predator_positions[0]
    assert_plays_as(Reference(scenario, options, state), rng, per_agent=per_agent)


@pytest.mark.parametrize(
    "changes",
    [
        {"neighbor_rule": Topological()},
        {"neighbor_rule": Voronoi()},
        {"blind_angle": 2.0},
        {"mutual": True},
        {"motion": Reynolds()},
    ],
    ids=str,
)
def test_candidates_are_what_the_agents_hear_after_they_chose_them(changes: dict[str, Any]) -> None:
    """After a step under rho_k, the heard velocity is candidate k of the observation before."""
    scenario = fe.FlockScenario(num_agents=70, **changes)
    ranges = (0.0, 3.0, 11.0, 40.0)
    options = fe.EnvOptions(action_mode="range", profile_ranges=ranges, **EVERY_STEP)
    batch = FlockBatch(scenario, options, num_flocks=len(ranges), per_agent=True)
    batch.reset(range(len(ranges)), [7] * len(ranges))
    actions = np.repeat(np.array(ranges, np.float32), 70)[:, None]
    columns = batch.policy_spec.layout.index
    for _ in range(3):
        before = batch.core.observe(range(len(ranges))).reshape(len(ranges), 70, -1)
        after = batch.step(actions)[0].reshape(len(ranges), 70, -1)
        for k in range(len(ranges)):
            count = after[k, :, columns("neighbor_count")]
            np.testing.assert_array_equal(before[k, :, columns(f"profile_{k}_neighbor_count")], count)
            heard = before[k][:, [columns(f"profile_{k}_velocity_{axis}") for axis in ("ahead", "left")]]
            told = after[k][:, [columns(f"heard_velocity_{axis}") for axis in ("ahead", "left")]]
            # The frame has turned; the length has not.
            lengths = np.linalg.norm(heard, axis=1), np.linalg.norm(told, axis=1)
            np.testing.assert_allclose(*lengths, atol=1e-6)
