"""Scenarios: documents in both directions, missing fields, copies and errors."""

from __future__ import annotations

import copy
import dataclasses
import json
import pickle
from typing import Any

import pytest
from extreme_scenarios import Bounds, flocks
from hypothesis import given
from hypothesis import strategies as st

import flockesc_env as fe

BOUNDS = Bounds()
PARTS: dict[str, Any] = {
    "initial_positions": st.sampled_from([fe.Square(), fe.Clusters(10**7, 0.1)])
    | st.builds(fe.Gaussian, BOUNDS.computed)
    | st.builds(fe.Segment, *[st.tuples(BOUNDS.coordinate, BOUNDS.coordinate)] * 2),
    "initial_headings": st.builds(
        fe.AlignedHeadings, st.tuples(*[st.floats(1e-3, 1e3)] * 2), st.floats(0, 3)
    ),
    "num_steps": st.integers(1, 10**9),
    "initial_plane": st.booleans(),
}


@st.composite
def varied(draw: st.DrawFn) -> fe.FlockScenario:
    scenario = draw(flocks(BOUNDS))
    each = st.lists(BOUNDS.dividing, min_size=scenario.num_agents, max_size=scenario.num_agents)
    parts = st.fixed_dictionaries({}, optional={"mass": each, "speed": each, **PARTS})
    return scenario.replace(**draw(parts))


lines = st.builds(
    fe.LineScenario,
    num_agents=st.integers(1, 10**7),
    predator_position=st.none() | BOUNDS.coordinate,
    predator_range=BOUNDS.computed,
    repulsion_strength=BOUNDS.computed,
    escape_force=st.sampled_from(["constant", "linear", "linear_as_printed"]),
    tolerance=BOUNDS.compared,
    max_steps=st.integers(1, 10**9),
)


@given(varied() | lines)
def test_documents_keep_every_bit(scenario: Any) -> None:
    document = scenario.to_json()
    again = type(scenario).from_json(document)
    assert again == scenario
    assert again.to_json() == document
    # Equality of floats ignores the sign of zero; repr does not.
    assert repr(again) == repr(type(scenario).from_toml(scenario.to_toml())) == repr(scenario)
    assert hash(again) == hash(scenario)
    assert pickle.loads(pickle.dumps(scenario)) == scenario  # noqa: S301, our own bytes
    assert copy.deepcopy(scenario) == scenario


@pytest.mark.parametrize("scenario", [fe.FlockScenario, fe.LineScenario])
def test_missing_fields_take_their_defaults(scenario: Any) -> None:
    assert scenario.from_json("{}") == scenario()
    assert scenario.from_json('{"num_agents": 7}') == scenario(num_agents=7)
    assert set(json.loads(scenario().to_json())) == {field.name for field in dataclasses.fields(scenario)}


def test_a_part_may_be_given_as_its_document() -> None:
    given = fe.FlockScenario(motion={"vicsek": {}}, predators=[{"pure_pursuit": {"max_turn_rate": 2}}])  # type: ignore[arg-type, list-item]
    assert given == fe.FlockScenario(motion=fe.Vicsek(), predators=(fe.PurePursuit(max_turn_rate=2.0),))


@pytest.mark.parametrize("make", [fe.ConstantVelocity, fe.PurePursuit, fe.Wandering, fe.Learned])
@pytest.mark.parametrize("name", ["position", "velocity"])
def test_predators_have_as_many_coordinates_as_the_world(make: Any, name: str) -> None:
    with pytest.raises(
        fe.ScenarioError, match=r"expected 3 numbers, because the dimension is 3, got \(1.0, 2.0\)"
    ) as caught:
        fe.FlockScenario(dimension=3, predators=(fe.ConstantVelocity(), make(**{name: (1.0, 2.0)})))
    assert caught.value.field == f"predators[1].{make.kind}.{name}"
    with pytest.raises(fe.ScenarioError) as caught:
        fe.FlockScenario().replace(dimension=3)
    assert caught.value.field == "predators[0].constant_velocity.position"


def test_learned_predators_keep_their_starts() -> None:
    swift = fe.Learned((1.0, 2.0), max_speed=40.0)
    made = fe.FlockScenario(predators=(fe.PurePursuit((5.0, 6.0)), swift)).with_learned_predators()
    assert made == fe.FlockScenario(predators=(fe.Learned((5.0, 6.0), (10.0, 10.0)), swift))
    with pytest.raises(fe.ScenarioError, match="predators: expected at least one predator"):
        fe.FlockScenario(predators=()).with_learned_predators()
