"""Presets run, are accepted by name instead of a scenario, and print as files to start from."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
from cli_runs import Ran
from envs import FLOCKS

import flockesc_env as fe
from flockesc_env.common.errors import ScenarioError
from studies.paper.plan import aimed

every_preset = pytest.mark.parametrize("name", fe.PRESETS)


GOLDEN = Path(__file__).parents[1] / "golden" / "presets.json"


def test_presets_have_not_changed() -> None:
    """A changed default makes another scenario under the same name, so results would not be comparable."""
    documents = {name: json.loads(fe.preset(name).to_json()) for name in fe.PRESETS}
    assert documents == json.loads(GOLDEN.read_text("utf-8"))


def test_presets_differ_as_described() -> None:
    assert len({known.scenario for known in fe.PRESETS.values()}) == len(fe.PRESETS)
    assert len({known.description for known in fe.PRESETS.values()}) == len(fe.PRESETS)
    assert fe.preset("paper-flock") == fe.FlockScenario()
    assert fe.preset("paper-line") == fe.LineScenario()
    assert fe.preset("edge-attack") == aimed(50.0)
    with pytest.raises(TypeError):
        fe.PRESETS["mine"] = fe.PRESETS["pursuit"]  # type: ignore[index]


@pytest.mark.parametrize("interface", [name for name in FLOCKS if name != "pursuit"])
def test_flock_environments_take_names(interface: str) -> None:
    for name in ("two-predators", None):
        assert FLOCKS[interface](name).unwrapped.scenario == fe.preset(name or "paper-flock")
    for wrong in ("escape", "paper-line", fe.LineScenario(), 5):
        with pytest.raises(ScenarioError) as caught:
            FLOCKS[interface](wrong)
        assert caught.value.field == "scenario"
        assert "paper-flock, " in str(caught.value)


@every_preset
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
    flags = ["--interaction-range", 0.2, "--set", "repulsion_strength=3", "--seed", 1, "--json"]
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
