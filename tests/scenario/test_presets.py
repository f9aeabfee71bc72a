"""Presets run, are accepted by name instead of a scenario, and print as files to start from."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from cli_runs import Ran

from flockesc_env import (
    PRESETS,
    FlockEscapeEnv,
    FlockScenario,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    env,
    parallel_env,
    preset,
    raw_env,
    record,
    rollout,
    simulate,
    simulate_line,
)
from flockesc_env.common.errors import ScenarioError
from flockesc_env.policies import FixedRange
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv
from studies.paper.plan import aimed

every_preset = pytest.mark.parametrize("name", PRESETS)


GOLDEN = Path(__file__).parents[1] / "golden" / "presets.json"


def test_presets_have_not_changed() -> None:
    """A changed default makes another scenario under the same name, so results would not be comparable."""
    documents = {name: json.loads(preset(name).to_json()) for name in PRESETS}
    assert documents == json.loads(GOLDEN.read_text())


@every_preset
def test_round_trips(name: str) -> None:
    scenario = preset(name)
    assert repr(type(scenario).from_json(scenario.to_json())) == repr(scenario)
    assert repr(type(scenario).from_toml(scenario.to_toml())) == repr(scenario)


@every_preset
def test_runs(name: str) -> None:
    scenario = preset(name)
    if isinstance(scenario, FlockScenario):
        flock = simulate(scenario.replace(num_steps=5), 10.0, seed=0)
        assert np.isfinite(flock.positions).all()
        assert flock.mean_distance.min() < flock.mean_distance[0]  # the predator approaches
    else:
        line = simulate_line(scenario.replace(max_steps=5), 0.1, seed=0)
        assert np.isfinite(line.states).all()


def test_presets_differ_as_described() -> None:
    assert len({known.scenario for known in PRESETS.values()}) == len(PRESETS)
    assert len({known.description for known in PRESETS.values()}) == len(PRESETS)
    assert preset("paper-flock") == FlockScenario()
    assert preset("paper-line") == LineScenario()
    assert preset("edge-attack") == aimed(50.0)
    with pytest.raises(TypeError):
        PRESETS["mine"] = PRESETS["pursuit"]  # type: ignore[index]


FLOCK_ENVIRONMENTS: dict[str, Callable[[Any], Any]] = {
    "gymnasium": FlockEscapeEnv,
    "gymnasium.make": lambda scenario: gymnasium.make("flockesc/FlockEscape-v0", scenario=scenario).unwrapped,
    "vector": lambda scenario: FlockVectorEnv(2, scenario),
    "make_vec": lambda scenario: gymnasium.make_vec("flockesc/FlockEscape-v0", 2, scenario=scenario),
    "parallel": parallel_env,
    "aec": lambda scenario: env(scenario).unwrapped,
    "raw aec": lambda scenario: raw_env(scenario).unwrapped,
    "sb3 flocks": lambda scenario: FlockVecEnv(2, scenario),
    "sb3 agents": lambda scenario: AgentVecEnv(1, scenario),
    "record": lambda scenario: record(scenario, FixedRange(1.0), 0),
}


@pytest.mark.parametrize("interface", FLOCK_ENVIRONMENTS)
def test_flock_environments_take_names(interface: str) -> None:
    make = FLOCK_ENVIRONMENTS[interface]
    assert make("two-predators").scenario == preset("two-predators")
    assert make(None).scenario == FlockScenario()
    for wrong in ("escape", "paper-line", LineScenario(), 5):
        with pytest.raises(ScenarioError) as caught:
            make(wrong)
        assert caught.value.field == "scenario"
        assert "paper-flock, " in str(caught.value)


def test_rollouts_take_names() -> None:
    named, given = (rollout(scenario, FixedRange(5.0), [3]) for scenario in ("pursuit", preset("pursuit")))
    assert named.min_mean_distance == given.min_mean_distance
    assert named.min_mean_distance != rollout("paper-flock", FixedRange(5.0), [3]).min_mean_distance


def test_line_environments_take_names() -> None:
    assert LineEscapeEnv("constant-line").scenario == preset("constant-line")
    with pytest.raises(ScenarioError) as caught:
        LineEscapeEnv("pursuit")
    assert "paper-line, constant-line" in str(caught.value)


@pytest.mark.parametrize("name", ["", "Pursuit", None, 5, ["pursuit"]])
def test_unknown_names_list_the_known_ones(name: Any) -> None:
    with pytest.raises(ScenarioError) as caught:
        preset(name)
    assert caught.value.expected == f"one of {', '.join(PRESETS)}"


def test_the_command_lists_all(capsys: pytest.CaptureFixture[str]) -> None:
    lines = Ran(capsys, "presets").out.splitlines()
    assert [line.split(maxsplit=1) for line in lines] == [
        [name, known.description] for name, known in PRESETS.items()
    ]
    assert max(map(len, lines)) <= 80
    entries = Ran(capsys, "presets", "--json").json()["presets"]
    assert [entry["name"] for entry in entries] == list(PRESETS)


@every_preset
def test_the_command_prints_a_file_to_start_from(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    known = PRESETS[name]
    document = Ran(capsys, "presets", name).out
    assert known.description in document.splitlines()[0]
    assert type(known.scenario).from_toml(document) == known.scenario
    [entry] = Ran(capsys, "presets", name, "--json").json()["presets"]
    assert type(known.scenario).from_json(json.dumps(entry["scenario"])) == known.scenario
    path = tmp_path / "mine.toml"
    path.write_text(document)
    flags = ["--interaction-range", 0.2, "--set", "repulsion_strength=3", "--seed", 1, "--json"]
    runs = [
        Ran(capsys, "simulate", "--scenario", name, *flags).json(),
        Ran(capsys, "simulate", "--scenario", path, *flags).json(),
    ]
    assert runs[0] == runs[1]
    assert runs[0]["scenario"] == {**entry["scenario"], "repulsion_strength": 3.0}


def test_a_line_without_predator_is_toml() -> None:
    """TOML has no null."""
    scenario = LineScenario(predator_position=None)
    assert tomllib.loads(scenario.to_toml())["predator_position"] == "None"
    assert LineScenario.from_toml(scenario.to_toml()) == scenario


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ("= 3", "document"),
        ("mass = nan", "mass"),
        ("mass = 1979-05-27", "mass"),
        ('mass = "None"', "mass"),
        ("wings = 2", "wings"),
        ("[initial_positions.ring]\nradius = -1", "initial_positions.ring.radius"),
    ],
)
def test_bad_toml_is_named(document: str, field: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        FlockScenario.from_toml(document)
    assert caught.value.field == field
