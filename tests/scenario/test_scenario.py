"""Scenarios: documents in both directions, missing fields, copies and errors."""

from __future__ import annotations

import copy
import dataclasses
import json
import pickle
from typing import Any

import numpy as np
import pytest
from extreme_scenarios import Bounds, flocks
from hypothesis import given
from hypothesis import strategies as st

from flockesc_env import (
    AlignedHeadings,
    Clusters,
    ConstantVelocity,
    EnvOptions,
    FlockScenario,
    Gaussian,
    Learned,
    LineOptions,
    LineScenario,
    PurePursuit,
    ScenarioError,
    Segment,
    Square,
    Vicsek,
    Wandering,
    simulate,
)

BOUNDS = Bounds()
PARTS: dict[str, Any] = {
    "initial_positions": st.sampled_from([Square(), Clusters(10**7, 0.1)])
    | st.builds(Gaussian, BOUNDS.computed)
    | st.builds(Segment, *[st.tuples(BOUNDS.coordinate, BOUNDS.coordinate)] * 2),
    "initial_headings": st.builds(AlignedHeadings, st.tuples(*[st.floats(1e-3, 1e3)] * 2), st.floats(0, 3)),
    "num_steps": st.integers(1, 10**9),
    "initial_plane": st.booleans(),
}


@st.composite
def varied(draw: st.DrawFn) -> FlockScenario:
    scenario = draw(flocks(BOUNDS))
    each = st.lists(BOUNDS.dividing, min_size=scenario.num_agents, max_size=scenario.num_agents)
    parts = st.fixed_dictionaries({}, optional={"mass": each, "speed": each, **PARTS})
    return scenario.replace(**draw(parts))


lines = st.builds(
    LineScenario,
    num_agents=st.integers(1, 10**7),
    predator_position=st.none() | BOUNDS.coordinate,
    predator_range=BOUNDS.computed,
    repulsion_strength=BOUNDS.computed,
    escape_force=st.sampled_from(["constant", "linear", "linear_as_printed"]),
    tolerance=BOUNDS.compared,
    max_steps=st.integers(1, 10**9),
)


@given(varied() | lines)
def test_toml_keeps_every_bit(scenario: Any) -> None:
    assert repr(type(scenario).from_toml(scenario.to_toml())) == repr(scenario)


@given(varied() | lines)
def test_json_keeps_every_bit(scenario: Any) -> None:
    document = scenario.to_json()
    again = type(scenario).from_json(document)
    assert again == scenario
    assert again.to_json() == document
    # Equality of floats ignores the sign of zero; repr does not.
    assert repr(again) == repr(scenario)
    assert hash(again) == hash(scenario)
    assert pickle.loads(pickle.dumps(scenario)) == scenario  # noqa: S301, our own bytes
    assert copy.deepcopy(scenario) == scenario


def test_the_core_reads_the_same_bits() -> None:
    """The core simulates the number that was written, also 0.1, which has no finite binary form."""
    scenario = FlockScenario(num_agents=1, num_steps=1, time_step=0.1, predators=())
    velocity = np.array([[0.3, 0.7]])
    run = simulate(scenario, 0.0, initial_positions=[[0.0, 0.0]], initial_velocities=velocity)
    np.testing.assert_array_equal(run.positions[1], 0.1 * velocity)


@pytest.mark.parametrize("scenario", [FlockScenario, LineScenario])
def test_missing_fields_take_their_defaults(scenario: Any) -> None:
    assert scenario.from_json("{}") == scenario()
    assert scenario.from_json('{"num_agents": 7}') == scenario(num_agents=7)
    assert set(json.loads(scenario().to_json())) == {field.name for field in dataclasses.fields(scenario)}


def test_missing_fields_of_a_predator_take_their_defaults() -> None:
    document = '{"predators": [{"pure_pursuit": {"max_turn_rate": 2}}, {"constant_velocity": {}}]}'
    predators = FlockScenario.from_json(document).predators
    assert (
        predators == FlockScenario(predators=(PurePursuit(max_turn_rate=2.0), ConstantVelocity())).predators
    )


def test_replace_changes_one_field_of_a_copy() -> None:
    scenario = FlockScenario()
    changed = scenario.replace(num_agents=7, speed=3)
    assert (changed.num_agents, changed.speed) == (7, 3.0)
    assert changed.replace(num_agents=300, speed=10.0) == scenario == FlockScenario()
    with pytest.raises(TypeError):
        scenario.replace(num_agent=7)


@pytest.mark.parametrize(
    "value", [FlockScenario(), LineScenario(), ConstantVelocity(), EnvOptions(), LineOptions()]
)
def test_values_are_frozen_and_hashable(value: Any) -> None:
    name = dataclasses.fields(value)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(value, name, 5)
    assert hash(value) == hash(copy.deepcopy(value))
    assert {value: 1}[copy.deepcopy(value)] == 1


def test_a_part_may_be_given_as_its_document() -> None:
    given = FlockScenario(motion={"vicsek": {}}, predators=[{"pure_pursuit": {"max_turn_rate": 2}}])  # type: ignore[arg-type, list-item]
    assert given == FlockScenario(motion=Vicsek(), predators=(PurePursuit(max_turn_rate=2.0),))


@pytest.mark.parametrize("make", [ConstantVelocity, PurePursuit, Wandering, Learned])
@pytest.mark.parametrize("name", ["position", "velocity"])
def test_predators_have_as_many_coordinates_as_the_world(make: Any, name: str) -> None:
    with pytest.raises(
        ScenarioError, match=r"expected 3 numbers, because the dimension is 3, got \(1.0, 2.0\)"
    ) as caught:
        FlockScenario(dimension=3, predators=(ConstantVelocity(), make(**{name: (1.0, 2.0)})))
    assert caught.value.field == f"predators[1].{make.kind}.{name}"
    with pytest.raises(ScenarioError) as caught:
        FlockScenario().replace(dimension=3)
    assert caught.value.field == "predators[0].constant_velocity.position"


def test_a_predator_in_the_plane_z_0_stays_there() -> None:
    scenario = FlockScenario(
        dimension=3, num_steps=4, predators=(ConstantVelocity((-30.0, -30.0, 0.0), (10.0, 10.0, 0.0)),)
    )
    assert (simulate(scenario, 5.0, seed=0).predator_positions[..., 2] == 0).all()


def test_learned_predators_keep_their_starts() -> None:
    swift = Learned((1.0, 2.0), max_speed=40.0)
    made = FlockScenario(predators=(PurePursuit((5.0, 6.0)), swift)).with_learned_predators()
    assert made == FlockScenario(predators=(Learned((5.0, 6.0), (10.0, 10.0)), swift))
    with pytest.raises(ScenarioError, match="predators: expected at least one predator"):
        FlockScenario(predators=()).with_learned_predators()
