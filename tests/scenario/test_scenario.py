"""Scenarios: documents in both directions, missing fields, copies, presets by name, and approaches."""

import copy
import dataclasses
import json
import math
import pickle
import tomllib
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from argument_table import PARTS, SLOTS
from cli_runs import Cli
from envs import FLOCKS
from extreme_scenarios import Bounds, flocks
from hypothesis import given
from hypothesis import strategies as st
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import scenario as sc
from studies.paper.plan import aimed

BOUNDS = Bounds()
parts = st.sampled_from(
    [small_flock(**{slot: SLOTS[slot][0](part)}) for slot, part in (case.values for case in PARTS)]
)
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
DIRECTIONS = [(1.0, 1.0), (0.0, -3.0), (-2.0, 0.5), (1.0, 1.0, 1.0), (0.0, -3.0, 4.0), (-2.0, 0.5, 0.0)]
DEEP, HUGE = "[" * 100_000, "1" + "0" * 5000
HOSTILE = {
    "json": (DEEP, f'{{"num_agents": {HUGE}}}', '{"num_agents": 5, "num_agents": 6}', '{"\\ud800": 5}', "\0"),
    "toml": (f"mass = {DEEP}", f"num_agents = {HUGE}", "num_agents = 5\nnum_agents = 6", "mass = 1979-05-27"),
}
GOLDEN = Path(__file__).parents[1] / "golden" / "presets.json"


@given(flocks(BOUNDS) | parts | lines)
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
    assert given == fe.FlockScenario(motion=sc.Vicsek(), predators=(sc.PurePursuit(max_turn_rate=2.0),))


def test_learned_predators_keep_their_starts() -> None:
    swift = sc.Learned((1.0, 2.0), max_speed=40.0)
    made = fe.FlockScenario(predators=(sc.PurePursuit((5.0, 6.0)), swift)).with_learned_predators()
    assert made == fe.FlockScenario(predators=(sc.Learned((5.0, 6.0), (10.0, 10.0)), swift))
    with pytest.raises(fe.InputError, match="predators: expected at least one predator"):
        fe.FlockScenario(predators=()).with_learned_predators()


def test_presets_have_not_changed() -> None:
    """A changed default makes another scenario under the same name, so results would not be comparable."""
    documents = {name: json.loads(sc.preset(name).to_json()) for name in fe.PRESETS}
    assert documents == json.loads(GOLDEN.read_text("utf-8"))


def test_presets_differ_as_described() -> None:
    assert len({known.scenario for known in fe.PRESETS.values()}) == len(fe.PRESETS)
    assert len({known.description for known in fe.PRESETS.values()}) == len(fe.PRESETS)
    assert sc.preset("edge-attack") == aimed(50.0)
    with pytest.raises(TypeError):
        fe.PRESETS["mine"] = fe.PRESETS["pursuit"]  # type: ignore[index]


@pytest.mark.parametrize("interface", [name for name in FLOCKS if name != "predator"])
def test_flock_environments_take_names(interface: str) -> None:
    for name in ("two-predators", None):
        assert FLOCKS[interface](name).unwrapped.scenario == sc.preset(name or "paper-flock")
    lines = () if "slots" in interface else ("paper-line", fe.LineScenario())  # vec_env also makes lines
    for wrong in ("escape", *lines, 5):
        with pytest.raises(fe.InputError, match=r"^scenario: .*paper-flock, "):
            FLOCKS[interface](wrong)


@pytest.mark.parametrize("name", fe.PRESETS)
def test_the_command_prints_a_file_to_start_from(name: str, cli: Cli, tmp_path: Path) -> None:
    known = fe.PRESETS[name]
    document = cli("presets", name).out
    assert known.description in document.splitlines()[0]
    assert type(known.scenario).from_toml(document) == known.scenario
    path = tmp_path / "mine.toml"
    path.write_text(document)
    flags = ["fixed:0.2", "--set", "repulsion_strength=3", "--seed", 1, "--json"]
    runs = [
        cli("simulate", "--scenario", name, *flags).json(),
        cli("simulate", "--scenario", path, *flags).json(),
    ]
    assert runs[0] == runs[1]
    assert runs[0]["scenario"] == {**json.loads(known.scenario.to_json()), "repulsion_strength": 3.0}


def test_a_line_without_predator_is_toml() -> None:
    """TOML has no null."""
    scenario = fe.LineScenario(predator_position=None)
    assert tomllib.loads(scenario.to_toml())["predator_position"] == "None"
    assert fe.LineScenario.from_toml(scenario.to_toml()) == scenario


def test_the_default_is_the_papers_predator() -> None:
    assert sc.approach() == sc.approach("center") == ((-30.0, -30.0), (10.0, 10.0))
    assert fe.FlockScenario().predators == (sc.ConstantVelocity(*sc.approach()),)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("aim", ["center", "edge", "point", 0.0, 17.0, -5.0])
def test_the_path_misses_its_aim_by_the_offset(aim: Any, direction: tuple[float, ...]) -> None:
    """The whole region lies to the right of a path along the edge, and one corner lies on it."""
    dimension = len(direction)
    point, center = np.array([5.0, 6.0, 7.0])[:dimension], np.full(dimension, 15.0)
    options: dict[str, Any] = {"distance": 60.0, "speed": 7.0, "direction": direction, "initial_side": 30.0}
    given = sc.approach(tuple(point) if aim == "point" else aim, dimension=dimension, **options)
    position, velocity = map(np.array, given)
    heading = np.array(direction) / np.linalg.norm(direction)
    assert velocity == pytest.approx(7.0 * heading)
    left = np.array([-heading[1], heading[0], 0.0])[:dimension] / np.linalg.norm(heading[:2])
    corners = np.array(list(product((-15.0, 15.0), repeat=dimension)))
    offset = {"center": 0.0, "edge": (corners @ left).max(), "point": 0.0}.get(aim, aim)
    target = point if aim == "point" else center
    assert position + 60.0 * heading == pytest.approx(target + offset * left)


def test_only_the_direction_of_a_vector_counts() -> None:
    """Bit for bit, without overflow of squares, and without the last bit of ``math.hypot``."""
    for exponent in (-900, 0, 900):
        scaled = [math.ldexp(entry, exponent) for entry in (-2.0, 0.8)]
        _, velocity = sc.approach(direction=scaled, speed=7.0)
        assert velocity == tuple(7.0 * entry / math.sqrt(2.0 * 2.0 + 0.8 * 0.8) for entry in (-2.0, 0.8))


def test_in_space_the_default_flies_along_the_diagonal() -> None:
    """Equal to the preset ``space`` bit for bit, with every strategy."""
    assert sc.approach(dimension=3) == ((-30.0, -30.0, -30.0), (10.0, 10.0, 10.0))
    plain = fe.FlockScenario(dimension=3)
    assert plain == sc.preset("space") == fe.FlockScenario(dimension=3, predators=(sc.ConstantVelocity(),))
    assert fe.FlockScenario(dimension=3, predators=(sc.Intercept(),)).predators == (
        sc.Intercept(*sc.approach(dimension=3)),
    )
    half_given = fe.FlockScenario(dimension=3, predators=(sc.Intercept(velocity=(1.0, 2.0, 3.0)),))
    assert half_given.predators == (sc.Intercept((-30.0, -30.0, -30.0), (1.0, 2.0, 3.0)),)


PATH, POINTS = ((0.0, 0.0), (1.0, 2.0)), ((1.0, 2.0),) * 4
IN_PLANE = {"dimension": 3, "initial_plane": True}
TOO_MANY, UNEVEN = sc.Clusters(10**7 + 1), sc.GivenPositions((*POINTS, (1.0, 2.0, 3.0)))
AT_REST = sc.GivenHeadings((*POINTS, (0.0, 0.0)))
CONTRADICTIONS: list[tuple[dict[str, Any], str]] = [
    ({"motion": sc.Vicsek(), "constant_speed": False}, "constant_speed"),
    ({"neighbor_rule": sc.Voronoi(), "dimension": 3}, "neighbor_rule"),
    ({"periodic_side": 100.0, "predators": (), "neighbor_rule": sc.Voronoi()}, "periodic_side"),
    *(
        ({"periodic_side": 29.9, "predators": (), "initial_positions": positions}, "periodic_side")
        for positions in (sc.Square(), sc.Clusters(), sc.Disc(15.0), sc.Ring(14.0, 2.0))
    ),
    ({"predators": (sc.PurePursuit(target="assigned"),) * 65}, "predators"),
    ({"randomization": (sc.Uniform("mass", 0.1, 1.0),) * 10_001}, "randomization"),
    ({"randomization": (sc.RandomApproach(2),)}, "randomization[0].random_approach.predator"),
    *(
        ({"initial_positions": positions, **changes}, f"initial_positions.{field}")
        for positions, changes, field in (
            (TOO_MANY, {}, "clusters.num_clusters"),
            (sc.GivenPositions(POINTS), {}, "given_positions.points"),
            (UNEVEN, {}, "given_positions.points[4]"),
            (sc.Segment(end=(1.0, 1.0, -1.0)), IN_PLANE, "segment.end[2]"),
        )
    ),
    *(
        ({"initial_headings": headings, **changes}, f"initial_headings.{field}")
        for headings, changes, field in (
            (sc.AlignedHeadings((0.0, 1e300)), {}, "aligned.direction[1]"),
            (sc.AlignedHeadings((1.0, 0.0, 0.1)), IN_PLANE, "aligned.direction[2]"),
            (AT_REST, {}, "given_headings.directions[4]"),
        )
    ),
    *(
        ({"predators": (sc.ConstantVelocity(), predator)}, f"predators[1].{field}")
        for predator, field in (
            (sc.PurePursuit(target="centroid", confusion_rate=1.0), "pure_pursuit.confusion_rate"),
            (sc.PurePursuit(acceleration=1.0), "pure_pursuit.acceleration"),
            (sc.PurePursuit(max_speed=14.1), "pure_pursuit.max_speed"),
            (sc.Herd(partner=1), "herd.partner"),
            (sc.PrescribedPath(PATH[:1]), "prescribed_path.positions"),
            (sc.PrescribedPath(((0.0, 0.0), (1.0, 1e21))), "prescribed_path.positions[1][1]"),
        )
    ),
    ({"num_agents": 3.5}, "num_agents: expected an integer, got 3.5"),
    ({"mass": (0.1, "heavy")}, "mass[1]: expected a number, got 'heavy'"),
    ({"predators": sc.PurePursuit()}, "prescribed_path, attracted, got PurePursuit"),
    ({"motion": {"reynolds": {"cohesion": 1}}}, "got 'cohesion' (did you mean cohesion_strength?)"),
    (
        {"dimension": 3, "predators": (sc.Wandering((1.0, 2.0)),)},
        "predators[0].wandering.position: expected 3 numbers, got 2 numbers",
    ),
    ({"predators": (sc.ConstantVelocity(),) * 10_001}, "predators: expected at most 10000 predators, got"),
]


"""Arguments and the field that the error names, or words of the error."""


@pytest.mark.parametrize(("changes", "told"), CONTRADICTIONS)
def test_contradictions(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(fe.InputError) as caught:
        fe.FlockScenario(**{"num_agents": 5, **changes})
    assert told in str(caught.value) if " " in told else told == caught.value.field


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({"num_agent": 5}, "num_agent"),
        ({"predators": [{"constant_velocity": {"positon": [0]}}]}, "predators[0].constant_velocity.positon"),
        ({"predators": [{"constant_velocity": {}}, {"hawk": {}}]}, "predators[1]"),
        ({"predators": [{"constant_velocity": {}, "pure_pursuit": {}}]}, "predators[0]"),
        ({"predators": [{}]}, "predators[0]"),
        ({"predators": [{"pure_pursuit": 5}]}, "predators[0].pure_pursuit"),
        ({"speed": {"metric": {}}}, "speed"),
        ({"speed": np.nan}, "speed"),
        ([], "document"),
        (None, "document"),
    ],
)
def test_documents(document: Any, field: str) -> None:
    with pytest.raises(fe.InputError, check=lambda error: error.field == field):
        fe.FlockScenario.from_json(json.dumps(document))


@pytest.mark.parametrize("model", [fe.FlockScenario, fe.LineScenario])
@pytest.mark.parametrize("language", HOSTILE)
def test_hostile_texts_have_short_errors(model: Any, language: str) -> None:
    """Deep, huge, repeated and foreign values."""
    read = model.from_json if language == "json" else model.from_toml
    for text in HOSTILE[language]:
        with pytest.raises(fe.InputError) as caught:
            read(text)
        assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("field", ["num_agents", "num_steps", "sensing_delay"])
def test_large_numbers_take_no_memory_before_they_are_used(field: str) -> None:
    """Loading a scenario allocates no flock; only environments and simulations do."""
    assert getattr(fe.FlockScenario.from_json(json.dumps({field: 10**7})), field) == 10**7
