"""Scenarios: documents in both directions, conversion to plain values, and the paper's defaults."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
import pickle
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flockesc_env import (
    AlignedHeadings,
    Clusters,
    ConstantVelocity,
    Disc,
    Encircle,
    EnvOptions,
    FlockEscapeEnv,
    FlockScenario,
    Gaussian,
    Inertial,
    Intercept,
    Learned,
    LineOptions,
    LineScenario,
    Metric,
    PrescribedPath,
    PurePursuit,
    RandomHeadings,
    Reynolds,
    Ring,
    ScenarioError,
    Segment,
    Square,
    Vicsek,
    Wandering,
    simulate,
)
from flockesc_env.scenario.document import KINDS
from flockesc_env.scenario.initial import InitialHeadings, InitialPositions
from flockesc_env.scenario.predators import Predator

LARGEST = 1e20

finite = st.floats(-LARGEST, LARGEST)
not_negative = st.floats(0, LARGEST)
positive = st.floats(1 / LARGEST, LARGEST)
any_range = st.floats(0, allow_infinity=False)


def points(
    dimension: int, numbers: st.SearchStrategy[float] = finite
) -> st.SearchStrategy[tuple[float, ...]]:
    return st.sampled_from([2, dimension]).flatmap(lambda size: st.tuples(*[numbers] * size))


def predators(dimension: int) -> st.SearchStrategy[Predator]:
    vectors = st.tuples(*[finite] * dimension)
    steering = {"position": vectors, "velocity": vectors, "max_turn_rate": not_negative}
    speeds = st.tuples(*[st.floats(-1e10, 1e10)] * dimension)
    faster = steering | {
        "velocity": speeds,
        "max_speed": st.floats(1e11, LARGEST),
        "acceleration": not_negative,
    }
    return st.one_of(
        st.builds(ConstantVelocity, vectors, vectors),
        st.builds(Wandering, vectors, vectors, angular_diffusion=not_negative),
        st.builds(PrescribedPath, st.tuples(vectors, vectors), interval=st.none() | positive),
        st.builds(PurePursuit, **steering),
        st.builds(Intercept, **faster, navigation_constant=not_negative),
        st.builds(Encircle, **steering, radius=not_negative, closing_speed=not_negative),
    )


def initial_positions(dimension: int, *, plane: bool) -> st.SearchStrategy[InitialPositions]:
    ends = points(2 if plane else dimension)
    lengths = st.floats(1e-3, LARGEST)
    return st.one_of(
        st.just(Square()),
        st.builds(Disc, lengths),
        st.builds(lambda radius, part: Ring(radius, part * radius), lengths, st.floats(0, 2)),
        st.builds(Segment, ends, ends),
        st.builds(Gaussian, lengths),
        st.builds(Clusters, st.integers(1, 10**7), lengths),
    )


def initial_headings(dimension: int, *, plane: bool) -> st.SearchStrategy[InitialHeadings]:
    directions = points(2 if plane else dimension, st.floats(1e-3, 1e3))
    return st.just(RandomHeadings()) | st.builds(AlignedHeadings, directions, st.floats(0, math.pi))


def per_agent(agents: int, numbers: st.SearchStrategy[float]) -> st.SearchStrategy[float | tuple[float, ...]]:
    return numbers if agents > 10 else numbers | st.tuples(*[numbers] * agents)


@st.composite
def flocks(draw: st.DrawFn) -> FlockScenario:
    dimension = draw(st.sampled_from([2, 3]))
    plane = draw(st.booleans())
    agents = draw(st.integers(1, 10) | st.integers(1, 10**7))
    motion = draw(
        st.sampled_from([Inertial(), Vicsek()]) | st.builds(Reynolds, not_negative, not_negative, any_range)
    )
    return FlockScenario(
        num_agents=agents,
        dimension=dimension,
        num_steps=draw(st.integers(1, 10**9)),
        time_step=draw(positive),
        mass=draw(per_agent(agents, positive)),
        speed=draw(per_agent(agents, positive)),
        initial_side=draw(positive),
        initial_positions=draw(initial_positions(dimension, plane=plane)),
        initial_headings=draw(initial_headings(dimension, plane=plane)),
        initial_plane=plane,
        predator_range=draw(any_range),
        repulsion_strength=draw(per_agent(agents, not_negative)),
        alignment_strength=draw(per_agent(agents, not_negative)),
        motion=motion,
        angular_noise=draw(st.floats(0, 2 * math.pi)),
        sensing_noise=draw(not_negative),
        sensing_delay=draw(st.integers(0, 10**9)),
        constant_speed=motion == Vicsek() or draw(st.booleans()),
        predators=tuple(draw(st.lists(predators(dimension), max_size=3))),
    )


lines = st.builds(
    LineScenario,
    num_agents=st.integers(1, 10**7),
    predator_position=st.none() | finite,
    predator_range=not_negative,
    repulsion_strength=not_negative,
    escape_force=st.sampled_from(["constant", "linear", "linear_as_printed"]),
    tolerance=any_range,
    max_steps=st.integers(1, 10**9),
)


@given(flocks() | lines)
def test_toml_keeps_every_bit(scenario: Any) -> None:
    assert repr(type(scenario).from_toml(scenario.to_toml())) == repr(scenario)


@given(flocks() | lines)
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


def test_flock_defaults_are_the_papers_setting() -> None:
    assert dataclasses.asdict(FlockScenario()) == {
        "num_agents": 300,
        "dimension": 2,
        "num_steps": 240,
        "time_step": 0.05,
        "mass": 0.1,
        "speed": 10.0,
        "initial_side": 100.0,
        "initial_positions": {},
        "initial_headings": {},
        "initial_plane": False,
        "predator_range": 30.0,
        "repulsion_strength": 10.0,
        "alignment_strength": 1.0,
        "motion": {},
        "angular_noise": 0.0,
        "sensing_noise": 0.0,
        "sensing_delay": 0,
        "constant_speed": True,
        "capture_radius": None,
        "predators": ({"position": (-30.0, -30.0), "velocity": (10.0, 10.0)},),
        "neighbor_rule": {},
        "blind_angle": 0.0,
        "mutual": False,
        "frozen_graph": False,
        "periodic_side": None,
        "randomization": (),
    }
    assert FlockScenario().predators == (ConstantVelocity((-30.0, -30.0), (10.0, 10.0)),)
    assert FlockScenario().neighbor_rule == Metric()
    assert FlockScenario().initial_positions == Square()
    assert FlockScenario().initial_headings == RandomHeadings()
    times = simulate(FlockScenario(num_agents=1), 0.0, seed=0).times
    assert len(times) == 241
    assert times[-1] == 12.0


def test_line_defaults_are_the_papers_setting() -> None:
    assert dataclasses.asdict(LineScenario()) == {
        "num_agents": 100,
        "predator_position": 0.6,
        "predator_range": 0.2,
        "repulsion_strength": 2.0,
        "escape_force": "linear",
        "tolerance": 1e-12,
        "max_steps": 1000,
    }


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


def assert_plain(value: Any) -> None:
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            assert_plain(getattr(value, field.name))
    elif isinstance(value, tuple):
        for entry in value:
            assert_plain(entry)
    else:
        assert type(value) in {int, float, str, bool, type(None)}


def test_numpy_and_integer_inputs_become_plain() -> None:
    given_scenario = FlockScenario(
        num_agents=np.int64(7),
        num_steps=np.uint8(9),
        speed=np.float32(2.5),
        mass=1,
        constant_speed=np.bool(False),
        capture_radius=np.float32(1),
        initial_plane=np.bool(True),
        initial_positions=Segment([0, 1], np.array([2, 3])),
        initial_headings=AlignedHeadings(direction=[1, 0], max_angle=np.float32(1)),
        predators=[ConstantVelocity(np.array([1, 2]), [3, np.float64(4)]), PurePursuit(max_turn_rate=2)],
    )
    plain = FlockScenario(
        num_agents=7,
        num_steps=9,
        speed=2.5,
        mass=1.0,
        constant_speed=False,
        capture_radius=1.0,
        initial_plane=True,
        initial_positions=Segment((0.0, 1.0), (2.0, 3.0)),
        initial_headings=AlignedHeadings(direction=(1.0, 0.0), max_angle=1.0),
        predators=(ConstantVelocity((1.0, 2.0), (3.0, 4.0)), PurePursuit(max_turn_rate=2.0)),
    )
    assert given_scenario == plain
    assert repr(given_scenario) == repr(plain)
    assert hash(given_scenario) == hash(plain)
    assert_plain(given_scenario)
    assert_plain(LineScenario(predator_position=np.float32(0.5), tolerance=0))


def test_options_become_plain() -> None:
    options = EnvOptions(
        min_range=np.float32(1), max_range=50, range_grid=np.array([1, 2]), predator_sensing_range=5
    )
    assert options == EnvOptions(
        min_range=1.0, max_range=50.0, range_grid=(1.0, 2.0), predator_sensing_range=5.0
    )
    assert_plain(options)
    assert options.replace(min_range=0) == EnvOptions(
        max_range=50.0, range_grid=(1.0, 2.0), predator_sensing_range=5.0
    )


def test_numpy_integers_are_steps_per_action() -> None:
    options = EnvOptions(steps_per_action=np.int64(4))
    assert options == EnvOptions(steps_per_action=4)
    assert_plain(options.steps_per_action)
    assert FlockEscapeEnv(FlockScenario(num_agents=3), steps_per_action=np.int64(4)).reset(seed=0)


def test_a_part_may_be_given_as_its_document() -> None:
    given = FlockScenario(motion={"vicsek": {}}, predators=[{"pure_pursuit": {"max_turn_rate": 2}}])  # type: ignore[arg-type, list-item]
    assert given == FlockScenario(motion=Vicsek(), predators=(PurePursuit(max_turn_rate=2.0),))


def test_kinds_equal_those_of_the_unions() -> None:
    assert set(KINDS) == {
        *("predators", "neighbor_rules", "motions"),
        *("initial_positions", "initial_headings", "distributions"),
    }
    assert len(KINDS["predators"]) == len(get_args(Predator))


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
