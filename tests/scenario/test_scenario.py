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
from cli_runs import Ran
from envs import FLOCKS
from extreme_scenarios import Bounds, flocks
from hypothesis import given
from hypothesis import strategies as st
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import scenario as sc
from flockesc_env.common.errors import InputError
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


GOLDEN = Path(__file__).parents[1] / "golden" / "presets.json"


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
        with pytest.raises(InputError) as caught:
            FLOCKS[interface](wrong)
        assert caught.value.field == "scenario"
        assert "paper-flock, " in str(caught.value)


@pytest.mark.parametrize("name", fe.PRESETS)
def test_the_command_prints_a_file_to_start_from(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    known = fe.PRESETS[name]
    document = Ran(capsys, "presets", name).out
    assert known.description in document.splitlines()[0]
    assert type(known.scenario).from_toml(document) == known.scenario
    [entry] = Ran(capsys, "presets", name, "--json").json()["presets"]
    assert type(known.scenario).from_json(json.dumps(entry["scenario"])) == known.scenario
    path = tmp_path / "mine.toml"
    path.write_text(document)
    flags = ["fixed:0.2", "--set", "repulsion_strength=3", "--seed", 1, "--json"]
    runs = [
        Ran(capsys, "simulate", "--scenario", name, *flags).json(),
        Ran(capsys, "simulate", "--scenario", path, *flags).json(),
    ]
    assert runs[0] == runs[1]
    assert runs[0]["scenario"] == {**entry["scenario"], "repulsion_strength": 3.0}


def test_a_line_without_predator_is_toml() -> None:
    """TOML has no null."""
    scenario = fe.LineScenario(predator_position=None)
    assert tomllib.loads(scenario.to_toml())["predator_position"] == "None"
    assert fe.LineScenario.from_toml(scenario.to_toml()) == scenario


DIRECTIONS = [(1.0, 1.0), (0.0, -3.0), (-2.0, 0.5), (1.0, 1.0, 1.0), (0.0, -3.0, 4.0), (-2.0, 0.5, 0.0)]


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
