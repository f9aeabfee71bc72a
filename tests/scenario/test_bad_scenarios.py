"""Scenarios and options whose parts do not fit together: a ScenarioError names the field.

Bad values of single fields are in ``test_arguments``.
"""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
from option_table import INDIVIDUAL_REWARDS, small_flock

from flockesc_env import (
    AlignedHeadings,
    Clusters,
    ConstantVelocity,
    Disc,
    Encircle,
    EnvOptions,
    FlockEscapeEnv,
    FlockScenario,
    Herd,
    Intercept,
    LineEscapeEnv,
    LineOptions,
    LineScenario,
    PurePursuit,
    Ring,
    Segment,
    Vicsek,
    parallel_env,
    rollout,
)
from flockesc_env.common.errors import OptionError, ScenarioError
from flockesc_env.policies import FixedRange
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv


@pytest.mark.parametrize(
    ("dimension", "predator", "field"),
    [
        (2, ConstantVelocity((1.0, 2.0, 3.0)), "constant_velocity.position"),
        (3, ConstantVelocity((1.0, 2.0, 3.0, 4.0)), "constant_velocity.position"),
        (2, PurePursuit(target="centroid", confusion_rate=1.0), "pure_pursuit.confusion_rate"),
        (2, PurePursuit(target="assigned", confusion_rate=1.0), "pure_pursuit.confusion_rate"),
        (2, PurePursuit(acceleration=1.0), "pure_pursuit.acceleration"),
        *(
            (2, make(max_speed=14.1), f"{make.kind}.max_speed")
            for make in (PurePursuit, Intercept, Encircle, Herd)
        ),
        *((2, Herd(partner=bad), "herd.partner") for bad in (1, 2)),
    ],
)
def test_predators(dimension: int, predator: Any, field: str) -> None:
    """The allowed values depend on other fields."""
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(dimension=dimension, predators=(ConstantVelocity(), predator))
    assert caught.value.field == f"predators[1].{field}"


def test_too_many_predators_with_assigned_targets() -> None:
    pack = (PurePursuit(target="assigned"),) * 64
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(predators=(*pack, PurePursuit(), PurePursuit(target="assigned")))
    assert caught.value.field == "predators"
    assert len(FlockScenario(predators=(*pack, PurePursuit())).predators) == 65


@pytest.mark.parametrize(
    ("part", "field"),
    [
        (Disc(1e300), "positions.disc.radius"),
        (Ring(5.0, 10.1), "positions.ring.width"),
        (Clusters(10**7 + 1), "positions.clusters.num_clusters"),
        (Segment(end=(1.0, np.nan)), "positions.segment.end[1]"),
        (Segment(end=("0", 1.0)), "positions.segment.end[0]"),
        *(
            (AlignedHeadings(bad), "headings.aligned.direction")
            for bad in ((0.0, 0.0), (-0.0, 0.0), (1e-200, 0.0))
        ),
        (AlignedHeadings((np.inf, 0.0)), "headings.aligned.direction[0]"),
        (AlignedHeadings((0.0, 1e300)), "headings.aligned.direction[1]"),
    ],
)
def test_initial_states(part: Any, field: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(**{"initial_" + field.partition(".")[0]: part})
    assert caught.value.field == f"initial_{field}"


@pytest.mark.parametrize(
    ("field", "part"),
    [
        ("initial_positions.segment.start[2]", Segment((0.0, 0.0, 1.0), (1.0, 1.0, 0.0))),
        ("initial_positions.segment.end[2]", Segment(end=(1.0, 1.0, -1.0))),
        ("initial_headings.aligned.direction[2]", AlignedHeadings((1.0, 0.0, 0.1))),
    ],
)
def test_a_start_in_the_plane_refuses_a_height(field: str, part: Any) -> None:
    name = field.partition(".")[0]
    space = FlockScenario(dimension=3, **{name: part})
    with pytest.raises(ScenarioError) as caught:
        space.replace(initial_plane=True)
    assert caught.value.field == field


@pytest.mark.parametrize("entry", [None, 5, "pure_pursuit", FlockScenario, {"pure_persuit": {}}])
def test_objects_that_are_no_predators(entry: Any) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(predators=(ConstantVelocity(), entry))
    assert caught.value.field.startswith("predators[1]")


@pytest.mark.parametrize(
    ("fields", "name"),
    [
        ({"num_agents": 10**400}, "num_agents"),
        ({"speed": 10**400}, "speed"),
        ({"predators": (ConstantVelocity((10**400, 0)),)}, "predators[0].constant_velocity.position[0]"),
    ],
    ids=["num_agents", "speed", "position"],
)
def test_integers_too_large_for_a_float(fields: dict[str, Any], name: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(**fields)
    assert caught.value.field == name


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({"num_agent": 5}, "num_agent"),
        (
            {"predators": [{"constant_velocity": {"positon": [0, 0]}}]},
            "predators[0].constant_velocity.positon",
        ),
        (
            {"predators": [{"constant_velocity": {"max_turn_rate": 1}}]},
            "predators[0].constant_velocity.max_turn_rate",
        ),
        ({"predators": [{"constant_velocity": {}}, {"hawk": {}}]}, "predators[1]"),
        ({"predators": [{"constant_velocity": {}, "pure_pursuit": {}}]}, "predators[0]"),
        ({"predators": [{}]}, "predators[0]"),
        ({"predators": [{"metric": {}}]}, "predators[0]"),
        ({"predators": [{"pure_pursuit": 5}]}, "predators[0].pure_pursuit"),
        ({"neighbor_rule": {"metric": {"k": 5}}}, "neighbor_rule.metric.k"),
        ({"neighbor_rule": {"topological": {"k": 7}}}, "neighbor_rule.topological.k"),
        ({"neighbor_rule": {"pure_pursuit": {}}}, "neighbor_rule"),
        ({"initial_positions": {"ring": {"side": 5}}}, "initial_positions.ring.side"),
        ({"initial_positions": {"torus": {}}}, "initial_positions"),
        ({"initial_positions": {"random": {}}}, "initial_positions"),
        ({"initial_headings": {"ring": {}}}, "initial_headings"),
        ({"speed": {"metric": {}}}, "speed"),
        ({"speed": [10.0]}, "speed"),
        ({"motion": {"vicsek": {"noise": 1.0}}}, "motion.vicsek.noise"),
        ({"motion": {"metric": {}}}, "motion"),
        ([], "document"),
        (None, "document"),
        ("flock", "document"),
    ],
)
def test_documents(document: Any, field: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario.from_json(json.dumps(document))
    assert caught.value.field == field


@pytest.mark.parametrize("scenario", [FlockScenario, LineScenario])
@pytest.mark.parametrize("text", ["", "{", "{'num_agents': 5}", '{"num_agents": 5} x'])
def test_invalid_json(scenario: Any, text: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario.from_json(text)
    assert caught.value.field == "document"


@pytest.mark.parametrize("literal", ["NaN", "Infinity", "-Infinity", "1e400"])
def test_json_numbers_that_are_not_finite(literal: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario.from_json(f'{{"speed": {literal}}}')
    assert caught.value.field == "speed"


def test_unknown_fields_of_a_line() -> None:
    with pytest.raises(ScenarioError) as caught:
        LineScenario.from_json('{"num_steps": 5}')
    assert caught.value.field == "num_steps"


@pytest.mark.parametrize("options", [EnvOptions, LineOptions])
def test_replaced_options_are_checked(options: Any) -> None:
    good = options()
    with pytest.raises(OptionError) as caught:
        good.replace(min_range=-1.0)
    assert caught.value.field == "min_range"
    assert good == options()
    with pytest.raises(TypeError):
        good.replace(min_rnage=1.0)


FLOCK_VIEWS = {
    "gymnasium": lambda scenario, **options: FlockEscapeEnv(scenario, **options),
    "flock slots": lambda scenario, **options: FlockVecEnv(2, scenario, **options),
    "rollout": lambda scenario, **options: rollout(scenario, FixedRange(1.0), [0], **options),
}
AGENT_VIEWS = {
    "parallel": lambda scenario, **options: parallel_env(scenario, **options),
    "agent slots": lambda scenario, **options: AgentVecEnv(2, scenario, **options),
    "agent rollout": lambda scenario, **options: rollout(
        scenario, FixedRange(1.0), [0], per_agent=True, **options
    ),
}


@pytest.mark.parametrize("interface", FLOCK_VIEWS)
@pytest.mark.parametrize("reward", INDIVIDUAL_REWARDS)
def test_individual_rewards_need_a_range_per_agent(interface: str, reward: str) -> None:
    with pytest.raises(OptionError) as caught:
        FLOCK_VIEWS[interface](small_flock(), reward=reward)
    assert caught.value.field == "reward"


@pytest.mark.parametrize("interface", [*FLOCK_VIEWS, *AGENT_VIEWS])
def test_environments_need_a_predator(interface: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        (FLOCK_VIEWS | AGENT_VIEWS)[interface](small_flock(predators=()))
    assert caught.value.field == "predators"


def test_line_environment_needs_a_predator() -> None:
    with pytest.raises(ScenarioError) as caught:
        LineEscapeEnv(LineScenario(predator_position=None))
    assert caught.value.field == "predator_position"


@pytest.mark.parametrize("field", ["mass", "speed", "repulsion_strength", "alignment_strength"])
@pytest.mark.parametrize(
    ("values", "where", "expected"),
    [
        ((1.0, 2.0), "", "a number or 3 numbers"),
        ((1.0,) * 4, "", "a number or 3 numbers"),
        ((), "", "a number or 3 numbers"),
        ((1.0, 2.0, -1.0), "[2]", None),
        ((1.0, np.nan, 1.0), "[1]", None),
        ((1.0, "2", 1.0), "[1]", "a number"),
        ((1.0, None, 1.0), "[1]", "a number"),
        (((1.0,), (1.0,), (1.0,)), "[0]", "a number"),
    ],
)
def test_one_number_per_agent(field: str, values: Any, where: str, expected: str | None) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(num_agents=3, **{field: values})
    assert caught.value.field == field + where
    assert expected in {None, caught.value.expected}


def test_vicsek_needs_constant_speed() -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(motion=Vicsek(), constant_speed=False)
    assert caught.value.field == "constant_speed"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"num_agents": 3.5}, "num_agents: expected an integer, got 3.5"),
        ({"time_step": "long"}, "time_step: expected a number, got 'long'"),
        ({"mass": "heavy"}, "mass: expected a number or a list, got 'heavy'"),
        ({"mass": (0.1, "heavy")}, "mass[1]: expected a number, got 'heavy'"),
        ({"capture_radius": True}, "capture_radius: expected a number or None, got True"),
        ({"constant_speed": 1}, "constant_speed: expected true or false, got 1"),
        ({"predators": PurePursuit()}, "predators: expected a tuple of predators, got PurePursuit"),
        (
            {"predators": (PurePursuit(target="nearst"),)},  # type: ignore[arg-type]
            "predators[0].pure_pursuit.target: expected one of nearest, centroid, most_isolated, assigned,"
            " got 'nearst' (did you mean nearest?)",
        ),
        ({"neighbor_rule": {"topologic": {}}}, "got 'topologic' (did you mean topological?)"),
        ({"motion": {"reynolds": {"cohesion": 1}}}, "got 'cohesion' (did you mean cohesion_strength?)"),
    ],
)
def test_errors_name_type_and_value(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(message)):
        FlockScenario(**changes)
