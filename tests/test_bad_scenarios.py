"""Scenarios and environment options out of bounds: the error is a ScenarioError that names the field."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from option_table import OWN_REWARDS, small_flock

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
    Herd,
    Intercept,
    Learned,
    LineEscapeEnv,
    LineOptions,
    LineScenario,
    Metric,
    PurePursuit,
    RandomHeadings,
    Reynolds,
    Ring,
    Segment,
    Square,
    Vicsek,
    Wandering,
    parallel_env,
    rollout,
)
from flockesc_env.errors import ScenarioError
from flockesc_env.policies import FixedRange
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

NOT_FINITE = (float("nan"), float("inf"), -float("inf"))
NO_NUMBER = ("1", None, True, [1.0], {}, 1j, object())
NO_COUNT = (0, -1, 2.0, *NO_NUMBER, *NOT_FINITE)

BAD_FLOCK: dict[str, tuple[Any, ...]] = {
    "num_agents": (*NO_COUNT, 10**30),
    "dimension": (1, 4, *NO_COUNT),
    "num_steps": NO_COUNT,
    "time_step": (0.0, -0.1, *NO_NUMBER, *NOT_FINITE),
    "mass": (0, -0.1, *NO_NUMBER, *NOT_FINITE),
    "speed": (0.0, -10.0, *NO_NUMBER, *NOT_FINITE),
    "initial_side": (0.0, -1.0, *NO_NUMBER, *NOT_FINITE),
    "initial_positions": (None, "square", 5, True, [Square()], (), ConstantVelocity(), RandomHeadings(), {}),
    "initial_headings": (None, "random", 5, True, [RandomHeadings()], Metric(), Square()),
    "initial_plane": (1, 0.0, "yes", None),
    "predator_range": (-1e-9, *NO_NUMBER, *NOT_FINITE),
    "repulsion_strength": (-1e-9, *NO_NUMBER, *NOT_FINITE),
    "alignment_strength": (-1e-9, *NO_NUMBER, *NOT_FINITE),
    "motion": (None, "vicsek", 5, [Vicsek()], Metric()),
    "angular_noise": (-1e-9, 6.3, *NO_NUMBER, *NOT_FINITE),
    "sensing_noise": (-1e-9, *NO_NUMBER, *NOT_FINITE),
    "sensing_delay": (-1, 0.5, 10**30, *NO_NUMBER, *NOT_FINITE),
    "constant_speed": (1, 0.0, "yes", None),
    "predators": (None, 5, "pure_pursuit", ConstantVelocity()),
    "neighbor_rule": (None, "metric", 5, ConstantVelocity()),
    "blind_angle": (-0.1, 6.3, *NO_NUMBER, *NOT_FINITE),
    "mutual": (1, 0.0, "yes", None),
    "frozen_graph": (1, 0.0, "yes", None),
    "periodic_side": (0.0, -1.0, "1", True, [1.0], {}, *NOT_FINITE),
    "randomization": (None, 5, "uniform", (5,), (Metric(),), Metric()),
}

BAD_LINE: dict[str, tuple[Any, ...]] = {
    "num_agents": (*NO_COUNT, 10**30),
    "predator_position": ("0.6", True, [0.6], *NOT_FINITE),
    "predator_range": (-1e-9, *NO_NUMBER, *NOT_FINITE),
    "repulsion_strength": (-1e-9, *NO_NUMBER, *NOT_FINITE),
    "escape_force": ("Linear", "", None, 1),
    "tolerance": (-1e-15, *NO_NUMBER, *NOT_FINITE),
    "max_steps": NO_COUNT,
}


def cases(table: dict[str, tuple[Any, ...]]) -> list[Any]:
    return [
        pytest.param(field, value, id=f"{field}-{str(value)[:12]}")
        for field, values in table.items()
        for value in values
    ]


@pytest.mark.parametrize(("field", "value"), cases(BAD_FLOCK))
def test_flock_field(field: str, value: Any) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(**{field: value})
    assert caught.value.field.startswith(field)
    with pytest.raises(ScenarioError):
        FlockScenario().replace(**{field: value})


@pytest.mark.parametrize(("field", "value"), cases(BAD_LINE))
def test_line_field(field: str, value: Any) -> None:
    with pytest.raises(ScenarioError) as caught:
        LineScenario(**{field: value})
    assert caught.value.field.startswith(field)


@pytest.mark.parametrize(
    ("dimension", "predator", "field"),
    [
        (2, ConstantVelocity((1.0,)), "constant_velocity.position"),
        (2, ConstantVelocity((1.0, 2.0, 3.0)), "constant_velocity.position"),
        (3, ConstantVelocity((1.0, 2.0, 3.0, 4.0)), "constant_velocity.position"),
        (3, ConstantVelocity(velocity=()), "constant_velocity.velocity"),
        (2, ConstantVelocity(velocity=(1.0, np.nan)), "constant_velocity.velocity[1]"),
        (2, ConstantVelocity((np.inf, 0.0)), "constant_velocity.position[0]"),
        (2, ConstantVelocity(("0", 1.0)), "constant_velocity.position[0]"),
        (2, ConstantVelocity(5.0), "constant_velocity.position"),
        (2, PurePursuit(velocity=(0.0,)), "pure_pursuit.velocity"),
        (2, PurePursuit(max_turn_rate=-1.0), "pure_pursuit.max_turn_rate"),
        (2, PurePursuit(max_turn_rate=np.nan), "pure_pursuit.max_turn_rate"),
        (2, PurePursuit(max_turn_rate="fast"), "pure_pursuit.max_turn_rate"),
        (2, PurePursuit(target="farthest"), "pure_pursuit.target"),
        (2, PurePursuit(target=3), "pure_pursuit.target"),
        (2, PurePursuit(target=None), "pure_pursuit.target"),
        (2, PurePursuit(confusion_rate=-1.0), "pure_pursuit.confusion_rate"),
        (2, PurePursuit(confusion_rate=np.inf), "pure_pursuit.confusion_rate"),
        (2, PurePursuit(target="centroid", confusion_rate=1.0), "pure_pursuit.confusion_rate"),
        (2, PurePursuit(sight=-1.0), "pure_pursuit.sight"),
        (2, PurePursuit(sight="far"), "pure_pursuit.sight"),
        (2, Intercept((1.0, 2.0, 3.0)), "intercept.position"),
        (3, Intercept(velocity=(np.nan, 0.0)), "intercept.velocity[0]"),
        (2, Intercept(max_turn_rate=-1.0), "intercept.max_turn_rate"),
        (2, Intercept(navigation_constant=-1e-9), "intercept.navigation_constant"),
        (2, Intercept(navigation_constant=np.inf), "intercept.navigation_constant"),
        (2, Intercept(navigation_constant="3"), "intercept.navigation_constant"),
        *(
            (2, make(max_speed=bad), f"{make.kind}.max_speed")
            for make in (PurePursuit, Intercept, Encircle, Herd)
            for bad in (14.1, -1.0, "fast", True, *NOT_FINITE)
        ),
        *(
            (2, make(max_speed=20.0, acceleration=bad), f"{make.kind}.acceleration")
            for make in (PurePursuit, Intercept, Encircle, Herd)
            for bad in (-1.0, *NO_NUMBER, *NOT_FINITE)
        ),
        (2, PurePursuit(acceleration=1.0), "pure_pursuit.acceleration"),
        (2, PurePursuit(target="assigned", confusion_rate=1.0), "pure_pursuit.confusion_rate"),
        (2, Encircle((1.0, 2.0, 3.0)), "encircle.position"),
        (2, Encircle(max_turn_rate=-1.0), "encircle.max_turn_rate"),
        *((2, Encircle(radius=bad), "encircle.radius") for bad in (-1.0, *NO_NUMBER, *NOT_FINITE)),
        *((2, Encircle(closing_speed=bad), "encircle.closing_speed") for bad in (-1.0, None, *NOT_FINITE)),
        (3, Herd(velocity=(1.0,)), "herd.velocity"),
        (2, Herd(max_turn_rate=np.inf), "herd.max_turn_rate"),
        *((2, Herd(distance=bad), "herd.distance") for bad in (-1.0, *NO_NUMBER, *NOT_FINITE)),
        *((2, Herd(partner=bad), "herd.partner") for bad in (1, 2, -1, 0.0, 10**30, *NO_NUMBER)),
        (2, Wandering((1.0,)), "wandering.position"),
        (2, Wandering(angular_diffusion=-0.1), "wandering.angular_diffusion"),
        (2, Wandering(angular_diffusion=np.nan), "wandering.angular_diffusion"),
        (2, Wandering(angular_diffusion=None), "wandering.angular_diffusion"),
        (2, Learned((1.0,)), "learned.position"),
        (2, Learned(velocity=(0.0, np.inf)), "learned.velocity[1]"),
        (2, Learned(max_acceleration=-1.0), "learned.max_acceleration"),
        (2, Learned(max_acceleration=np.nan), "learned.max_acceleration"),
        (2, Learned(max_speed=0.0), "learned.max_speed"),
        (2, Learned(max_speed=None), "learned.max_speed"),
    ],
)
def test_predators(dimension: int, predator: Any, field: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(dimension=dimension, predators=(ConstantVelocity(), predator))
    # What is no number at all is named together with its own place.
    assert caught.value.field.startswith(f"predators[1].{field}")


def test_too_many_predators_share_out_agents() -> None:
    pack = (PurePursuit(target="assigned"),) * 64
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(predators=(*pack, PurePursuit(), PurePursuit(target="assigned")))
    assert caught.value.field == "predators"
    assert len(FlockScenario(predators=(*pack, PurePursuit())).predators) == 65


@pytest.mark.parametrize(
    ("part", "field"),
    [
        *((Disc(bad), "positions.disc.radius") for bad in (0.0, -1.0, 1e300, *NO_NUMBER, *NOT_FINITE)),
        *((Ring(bad), "positions.ring.radius") for bad in (0.0, -1.0, 1e300, *NO_NUMBER, *NOT_FINITE)),
        *((Ring(5.0, bad), "positions.ring.width") for bad in (-0.1, 10.1, *NO_NUMBER, *NOT_FINITE)),
        *(
            (Gaussian(bad), "positions.gaussian.standard_deviation")
            for bad in (-1.0, 1e300, *NO_NUMBER, *NOT_FINITE)
        ),
        *((Clusters(bad), "positions.clusters.num_clusters") for bad in (*NO_COUNT, 10**7 + 1, 10**30)),
        *((Clusters(2, bad), "positions.clusters.spread") for bad in (-1.0, 1e300, *NO_NUMBER, *NOT_FINITE)),
        *((Segment(bad), "positions.segment.start") for bad in ((), (1.0,), (1.0, 2.0, 3.0), 5.0, None)),
        (Segment(end=(1.0, np.nan)), "positions.segment.end[1]"),
        (Segment(end=("0", 1.0)), "positions.segment.end[0]"),
        *(
            (AlignedHeadings(bad), "headings.aligned.direction")
            for bad in (
                (),
                (1.0,),
                (1.0, 0.0, 0.0),
                (0.0, 0.0),
                (-0.0, 0.0),
                (1e-200, 0.0),
                (1e300, 0.0),
                1.0,
            )
        ),
        (AlignedHeadings((np.inf, 0.0)), "headings.aligned.direction[0]"),
        *(
            (AlignedHeadings(spread=bad), "headings.aligned.spread")
            for bad in (-0.1, 3.2, *NO_NUMBER, *NOT_FINITE)
        ),
    ],
)
def test_initial_states(part: Any, field: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(**{"initial_" + field.partition(".")[0]: part})
    # What is no number at all is named together with its own place.
    assert caught.value.field.startswith(f"initial_{field}")


@pytest.mark.parametrize(
    ("field", "part"),
    [
        ("initial_positions.segment.start[2]", Segment((0.0, 0.0, 1.0), (1.0, 1.0, 0.0))),
        ("initial_positions.segment.end[2]", Segment(end=(1.0, 1.0, -1.0))),
        ("initial_headings.aligned.direction[2]", AlignedHeadings((1.0, 0.0, 0.1))),
    ],
)
def test_a_flock_that_starts_in_the_plane_has_no_height(field: str, part: Any) -> None:
    name = field.partition(".")[0]
    space = FlockScenario(dimension=3, **{name: part})
    with pytest.raises(ScenarioError) as caught:
        space.replace(initial_plane=True)
    assert caught.value.field == field


@pytest.mark.parametrize("entry", [None, 5, "pure_pursuit", FlockScenario, {"pure_pursuit": {}}])
def test_what_is_no_predator(entry: Any) -> None:
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
def test_integers_beyond_all_floats(fields: dict[str, Any], name: str) -> None:
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
def test_texts_that_are_no_json(scenario: Any, text: str) -> None:
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


BAD_ACTION_OPTIONS: dict[str, tuple[Any, ...]] = {
    "action_mode": ("continuous", "", None, 1),
    "min_range": (-0.1, 1e6, "0", None, True, [0.0], *NOT_FINITE),
    "max_range": (0.0, -1.0, "1", None, True, [1.0], *NOT_FINITE),
    "range_grid": ((), (-1.0,), (1e6,), (0.0, np.nan), 5.0, ((0.0,),), ("a",), ((0.0,), (0.0, 0.1))),
    "steps_per_action": (0, -1, 1.5, "1", None),
}
BAD_ENV_OPTIONS = BAD_ACTION_OPTIONS | {
    "objective": ("maximum", None, 0),
    "reward": ("sparse", None, 0),
    "predator_sensing_range": (-1.0, "far", True, [5.0], *NOT_FINITE),
    "count_components": (1, 0.0, "yes", None),
}
BAD_LINE_OPTIONS = BAD_ACTION_OPTIONS | {"reward": ("running_minimum", None, 0)}


@pytest.mark.parametrize(("field", "value"), cases(BAD_ENV_OPTIONS))
def test_flock_options(field: str, value: Any) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockEscapeEnv(small_flock(), **{field: value})
    # Either bound may be named where the two do not fit together.
    names = ("min_range", "max_range") if field in {"min_range", "max_range"} else (field,)
    assert caught.value.field.startswith(names)


@pytest.mark.parametrize(("field", "value"), cases(BAD_LINE_OPTIONS))
def test_line_options(field: str, value: Any) -> None:
    with pytest.raises(ScenarioError) as caught:
        LineEscapeEnv(LineScenario(num_agents=5), **{field: value})
    names = ("min_range", "max_range") if field in {"min_range", "max_range"} else (field,)
    assert caught.value.field.startswith(names)


@pytest.mark.parametrize("options", [EnvOptions, LineOptions])
def test_replaced_options_are_checked(options: Any) -> None:
    good = options()
    with pytest.raises(ScenarioError) as caught:
        good.replace(min_range=-1.0)
    assert caught.value.field == "min_range"
    assert good == options()
    with pytest.raises(TypeError):
        good.replace(min_rnage=1.0)


FLOCK_VIEWS = {
    "gymnasium": lambda scenario, **options: FlockEscapeEnv(scenario, **options),
    "flock slots": lambda scenario, **options: FlockVecEnv(2, scenario, **options),
    "rollout": lambda scenario, **options: rollout(FixedRange(1.0), [0], scenario=scenario, **options),
}
AGENT_VIEWS = {
    "parallel": lambda scenario, **options: parallel_env(scenario, **options),
    "agent slots": lambda scenario, **options: AgentVecEnv(2, scenario, **options),
    "agent rollout": lambda scenario, **options: rollout(
        FixedRange(1.0), [0], scenario=scenario, per_agent=True, **options
    ),
}


@pytest.mark.parametrize("interface", FLOCK_VIEWS)
@pytest.mark.parametrize("reward", OWN_REWARDS)
def test_own_rewards_need_a_range_per_agent(interface: str, reward: str) -> None:
    with pytest.raises(ScenarioError) as caught:
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


@pytest.mark.parametrize("field", ["separation_strength", "cohesion_strength", "separation_range"])
@pytest.mark.parametrize("value", [-1e-9, *NO_NUMBER, *NOT_FINITE])
def test_boids(field: str, value: Any) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(motion=Reynolds(**{field: value}))
    assert caught.value.field.startswith(f"motion.reynolds.{field}")


def test_vicseks_agents_keep_their_speed() -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(motion=Vicsek(), constant_speed=False)
    assert caught.value.field == "constant_speed"


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"num_agents": 3.5}, "an integer of at least 0"),
        ({"time_step": "long"}, "a number"),
        ({"mass": "heavy"}, "a number, or a list of one per agent"),
        ({"predators": 3}, "a list"),
        ({"constant_speed": 1}, "true or false"),
    ],
)
def test_errors_speak_of_the_document(changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario(**changes)
    assert caught.value.expected == expected
