"""The command line names bad input before it writes anything."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_runs import SMALL_FLAGS, Ran, plain, sweep_flags

from flockesc_env.cli.exits import Exit


@pytest.fixture(autouse=True)
def _narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def _set(change: str) -> list[str]:
    return ["simulate", "--interaction-range", "1", "--set", change]


BAD = {
    "field": (_set("num_agents=0"), "num_agents: expected an integer"),
    "part": (
        _set("predators.0.max_turn=1"),
        "predators[0].constant_velocity.max_turn: expected one of position, velocity, got",
    ),
    "index": (_set("predators.1.velocity=1"), "predators.1.velocity: expected an index below 1, got '1'"),
    "name of an index": (
        _set("predators.first=1"),
        "predators.first: expected an index below 1, got 'first'",
    ),
    "path": (_set("num_agents.0=1"), "num_agents.0: expected the path of a field, got '0' inside"),
    "index of many digits": (
        _set(f"predators.{'9' * 5000}.velocity=1"),
        "expected an index below 1, got '999",
    ),
    "inside a number": (
        [*_set('predators.0={"pure_pursuit": 5}'), "--set", "predators.0.target=1"],
        "predators.0.target: expected the path of a field, got 'target' inside a plain value",
    ),
    "a field twice": (
        _set('motion={"vicsek": {}, "vicsek": {}}'),
        "motion: expected valid JSON, got the key 'vicsek' more than once",
    ),
    "half a list": (_set("mass=[1, 2"), "mass: expected valid JSON, got Expecting ',' delimiter"),
    "unknown field": (_set("num_agent=1"), "got 'num_agent' (did you mean num_agents?)"),
    "no value": (_set("num_agents"), "set: expected PATH=VALUE, got 'num_agents'"),
    "type": (_set("num_agents=many"), "num_agents: expected an integer, got 'many'"),
    "entry": (
        _set("predators.0.position.1=NaN"),
        "predators[0].constant_velocity.position[1]: expected a finite",
    ),
    "kind": (_set("motion=vicsec"), "got 'vicsec' (did you mean vicsek?)"),
    "text for a list": (_set("predators=pure_pursuit"), "predators: expected a tuple of predators, got str"),
    "start": (
        [*_set("initial_positions=ring"), "--set", "initial_positions.radius=0"],
        "initial_positions.ring.radius: expected",
    ),
    "range": (
        ["simulate", "--interaction-range", "nan"],
        "interaction_range: expected a finite number, got nan",
    ),
    "seed": (["simulate", "--interaction-range", "1", "--seed", "-1"], "seed: expected an integer from 0"),
    "suffix": (
        ["simulate", "--interaction-range", "1", "--output", "run.txt"],
        "output: expected a file that ends",
    ),
    "folder": (["sweep", "--output", "nowhere/run.csv"], "output: expected a file in an existing folder"),
    "file": (["simulate", "--interaction-range", "1", "--scenario", "none.toml"], "none.toml: No such file"),
    "seeds": (["sweep", "--seeds", "4:4"], "seeds: expected START:STOP with START below STOP, got 4:4"),
    "many seeds": (["sweep", "--seeds", f"0:{10**40}"], "seeds: expected START:STOP"),
    "late seeds": (["sweep", "--seeds", f"{2**64}:{2**64 + 1}"], "seeds: expected an integer from 0"),
    "no ranges": (
        ["sweep", "--interaction-ranges"],
        "interaction_ranges: expected at least one range, got none",
    ),
    "ranges": (["sweep", "--interaction-ranges", "1", "-2"], "interaction_ranges[1]: expected"),
    "two grids": (
        ["sweep", "--interaction-ranges", "1", "--grid-size", "3"],
        "interaction_ranges: expected either ranges or a grid (max_range, grid_size), got both",
    ),
    "grid": (["sweep", "--grid-size", "0"], "grid_size: expected an integer from 1"),
    "largest": (["sweep", "--max-range", "-1"], "max_range: expected a number of at least 0, got -1"),
    "objective": (["sweep", "--objective", "escape_distance"], "objective: expected one of mean, minimum"),
    "threads": (["sweep", "--num-threads", "0"], "num_threads: expected an integer from 1"),
    "files": (["replay"], "files: expected at least one file, got none"),
    "flag": (["simulate", "--interaction-range", "1", "--num-agents", "4"], "--num-agents"),
    "missing": (["simulate"], "interaction_range: expected either interaction_range or policy, got neither"),
    "two rules": (
        ["simulate", "--interaction-range", "1", "--policy", "random"],
        "interaction_range: expected either interaction_range or policy, got both",
    ),
    "policy": (["simulate", "--policy", "fixed:far"], "policy: expected one of fixed:RHO"),
    "relative module": (["simulate", "--policy", "..:x"], "policy: expected one of fixed:RHO"),
    "function with arguments": (
        ["simulate", "--policy", "os.path:join"],
        "policy: expected one of fixed:RHO",
    ),
    "no function": (["simulate", "--policy", "math:pi"], "policy: expected one of fixed:RHO"),
    "many workers": (["sweep", "--backend", f"processes:{'9' * 5000}"], "backend: expected one of serial"),
    "escape sequence": (["sweep", "--\x1b[2J"], r"--\x1b[2J"),
    "policy of a line": (
        ["simulate", "--scenario", "paper-line", "--policy", "random"],
        "policy: expected None for a line, got 'random'",
    ),
    "no preset": (
        ["simulate", "--interaction-range", "1", "--scenario", "escape"],
        "scenario: expected a file or one of paper-flock, paper-line,",
    ),
    "unknown preset": (["presets", "persuit"], "got 'persuit' (did you mean pursuit?)"),
    "no range of seeds": (["sweep", "--seeds", "5"], "expected START:STOP"),
    "command": (["fly"], "simulate, sweep, presets, watch, replay"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_named(
    name: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    argv, message = BAD[name]
    monkeypatch.chdir(tmp_path)
    ran = Ran(capsys, *argv)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    assert message in " ".join(plain(ran.err).split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("num_agent = 3", "num_agent: expected one of num_agents"),
        ("mass = nan", "mass: expected a finite number"),
        ("mass = 1979-05-27", "mass: expected"),
        ("= 3", "document: expected valid TOML"),
        ("\xff", "expected TOML or JSON"),
        ("[[predators]]\npure_pursuit = { turn = 1 }", "predators[0].pure_pursuit.turn: expected one of"),
    ],
)
def test_a_bad_scenario_file_is_named(
    content: str, message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(content.encode("latin-1"))
    ran = Ran(capsys, "simulate", "--interaction-range", 1, "--scenario", path)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    assert ran.err.startswith(f"flockesc: error: {path}: ")
    assert message in ran.err


def test_a_missing_extra_is_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("flockesc_env.common.extras.find_spec", lambda _: None)
    ran = Ran(capsys, *sweep_flags("--output", tmp_path / "sweep.parquet"))
    assert ran.code == Exit.REFUSED
    assert 'error: polars is not installed; run `pip install "flockesc-env[analysis]"`' in ran.err
    ran = Ran(capsys, "watch", *SMALL_FLAGS, "--output", tmp_path / "flock.mp4")
    assert (ran.code, list(tmp_path.iterdir())) == (Exit.REFUSED, [])
    assert 'error: pygame is not installed; run `pip install "flockesc-env[video]"`' in ran.err
    ran = Ran(capsys, *sweep_flags("--json"))
    assert ran.code == Exit.DONE
    assert ran.json()["ranges"][0]["low"] is None
    assert "intervals are omitted: scipy is not installed; run `pip install" in ran.err
