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
    "part": (
        _set("predators.0.max_turn=1"),
        "predators[0].constant_velocity.max_turn: expected one of position, velocity, got",
    ),
    "index": (_set("predators.1.velocity=1"), "predators.1.velocity: expected an index below 1, got '1'"),
    "path": (_set("num_agents.0=1"), "num_agents.0: expected the path of a field, got '0' inside"),
    "inside a number": (
        [*_set('predators.0={"pure_pursuit": 5}'), "--set", "predators.0.target=1"],
        "predators.0.target: expected the path of a field, got 'target' inside a plain value",
    ),
    "unknown field": (_set("num_agent=1"), "got 'num_agent' (did you mean num_agents?)"),
    "no value": (_set("num_agents"), "set: expected PATH=VALUE, got 'num_agents'"),
    "suffix": (
        ["simulate", "--interaction-range", "1", "--output", "run.txt"],
        "output: expected a file that ends",
    ),
    "folder": (["sweep", "--output", "nowhere/run.csv"], "output: expected a file in an existing folder"),
    "file": (["simulate", "--interaction-range", "1", "--scenario", "none.toml"], "none.toml: No such file"),
    "seeds": (["sweep", "--seeds", "4:4"], "seeds: expected START:STOP with START below STOP, got 4:4"),
    "late seeds": (["sweep", "--seeds", f"{2**64}:{2**64 + 1}"], "seeds: expected an integer from 0"),
    "no ranges": (
        ["sweep", "--interaction-ranges"],
        "interaction_ranges: expected at least one range, got none",
    ),
    "two grids": (
        ["sweep", "--interaction-ranges", "1", "--grid-size", "3"],
        "interaction_ranges: expected either ranges or a grid (max_range, grid_size), got both",
    ),
    "objective": (["sweep", "--objective", "escape_distance"], "objective: expected one of mean, minimum"),
    "files": (["replay"], "files: expected at least one file, got none"),
    "two rules": (
        ["simulate", "--interaction-range", "1", "--policy", "random"],
        "interaction_range: expected either interaction_range or policy, got both",
    ),
    "policy": (["simulate", "--policy", "fixed:far"], "policy: expected one of fixed:RHO"),
    "no function": (["simulate", "--policy", "math:pi"], "policy: expected one of fixed:RHO"),
    "escape sequence": (["sweep", "--\x1b[2J"], r"--\x1b[2J"),
    "policy of a line": (
        ["simulate", "--scenario", "paper-line", "--policy", "random"],
        "policy: expected None for a line, got 'random'",
    ),
    "no preset": (
        ["simulate", "--interaction-range", "1", "--scenario", "escape"],
        "scenario: expected a file or one of paper-flock, paper-line,",
    ),
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
