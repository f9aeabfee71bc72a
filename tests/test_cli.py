"""The command line gives the library's results, names what it refuses and ends with the promised code."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from flockesc_env import (
    ConstantVelocity,
    FlockScenario,
    LineScenario,
    PurePursuit,
    __version__,
    simulate,
    simulate_line,
    sweep,
)
from flockesc_env.cli import COMMANDS, main
from flockesc_env.cli.exits import MEANINGS, Exit
from flockesc_env.records import load, save

SMALL = FlockScenario(num_agents=12, num_steps=9)
SMALL_FLAGS = ["--num-agents", "12", "--num-steps", "9"]
FLOCKESC = [sys.executable, "-m", "flockesc_env"]
TIMEOUT = 60  # seconds; reached only by a command that does not end


@pytest.fixture(autouse=True)
def _narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


class Ran:
    """What a command left: its code, stdout and stderr."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *argv: object) -> None:
        self.code = main([str(word) for word in argv])
        self.out, self.err = capsys.readouterr()

    def json(self) -> dict[str, Any]:
        document: dict[str, Any] = json.loads(self.out)
        return document


def run_process(*argv: object, **streams: Any) -> subprocess.CompletedProcess[str]:
    command = [*FLOCKESC, *map(str, argv)]
    return subprocess.run(command, text=True, timeout=TIMEOUT, check=False, **streams)  # noqa: S603


def test_a_simulation_is_the_librarys(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    flags = ["--interaction-range", 10, "--seed", 7, *SMALL_FLAGS]
    ran = Ran(capsys, "simulate", *flags, "--json", "--output", path)
    run = simulate(SMALL, 10.0, seed=7)
    document = ran.json()
    assert ran.code == Exit.DONE
    assert document["min_mean_distance"] == run.mean_distance.min()
    assert document["min_min_distance"] == run.min_distance.min()
    assert document["num_components"] == run.num_components[-1]
    assert document["polarization"] == run.polarization[-1]
    assert FlockScenario.from_json(json.dumps(document["scenario"])) == SMALL
    np.testing.assert_array_equal(load(path).trajectory.positions, run.positions)

    for_people = Ran(capsys, "simulate", *flags).out
    assert f"{run.mean_distance.min():.3f}" in for_people
    assert "J_mean" in for_people


def test_a_line_is_simulated(capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, "simulate", "--model", "line", "--interaction-range", 0.1, "--seed", 7, "--json")
    run = simulate_line(LineScenario(), 0.1, seed=7)
    document = ran.json()
    assert (document["escape_distance"], document["steps"]) == (run.escape_distance[-1], run.steps)
    assert document["converged"] is run.converged


def test_a_seed_that_is_not_given_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    documents = [
        Ran(capsys, "simulate", "--interaction-range", 3, *SMALL_FLAGS, "--json").json() for _ in range(2)
    ]
    first, second = documents
    assert first["seed"] != second["seed"]
    assert first["polarization"] == simulate(SMALL, 3.0, seed=first["seed"]).polarization[-1]


def test_without_a_predator_distances_are_null(capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--interaction-range", 3, *SMALL_FLAGS, "--predators", "--json"]
    document = Ran(capsys, "simulate", *flags).json()
    assert document["scenario"]["predators"] == []
    assert document["min_mean_distance"] is None


CHANGED: dict[str, tuple[list[str], FlockScenario | LineScenario]] = {
    "numbers": (
        ["--time-step", "0.1", "--no-constant-speed", "--initial-region", "square"],
        SMALL.replace(time_step=0.1, constant_speed=False, initial_region="square"),
    ),
    "predators": (
        ["--predators", "pure_pursuit", "position=90,90", "max_turn_rate=2", "constant_velocity"],
        SMALL.replace(predators=(PurePursuit(position=(90.0, 90.0), max_turn_rate=2.0), ConstantVelocity())),
    ),
    "in space": (
        ["--dimension", "3", "--predators", "constant_velocity", "position=-30,-30,1e1"],
        SMALL.replace(dimension=3, predators=(ConstantVelocity(position=(-30.0, -30.0, 10.0)),)),
    ),
    "neighbor rule": (["--neighbor-rule", "metric"], SMALL),
    "line": (
        ["--model", "line", "--predator-position", "None", "--escape-force", "constant"],
        LineScenario(num_agents=12, predator_position=None, escape_force="constant"),
    ),
}


@pytest.mark.parametrize("name", CHANGED)
def test_every_kind_of_field_is_a_flag(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    flags, scenario = CHANGED[name]
    own = SMALL_FLAGS if isinstance(scenario, FlockScenario) else SMALL_FLAGS[:2]
    ran = Ran(capsys, "simulate", "--interaction-range", 0.3, "--seed", 1, *own, *flags, "--json")
    assert type(scenario).from_json(json.dumps(ran.json()["scenario"])) == scenario


@pytest.mark.parametrize("suffix", [".toml", ".json"])
def test_a_scenario_comes_from_a_file_and_flags_override_it(
    suffix: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / f"storm{suffix}"
    toml = "num_agents = 12\nnum_steps = 30\n[[predators]]\npure_pursuit = { velocity = [12, 0] }\n"
    document = '{"num_agents": 12, "num_steps": 30, "predators": [{"pure_pursuit": {"velocity": [12, 0]}}]}'
    path.write_text(toml if suffix == ".toml" else document)
    ran = Ran(
        capsys,
        "simulate",
        "--interaction-range",
        3,
        "--scenario",
        path,
        "--num-steps",
        9,
        "--json",
        "--seed",
        1,
    )
    scenario = SMALL.replace(predators=(PurePursuit(velocity=(12.0, 0.0)),))
    assert FlockScenario.from_json(json.dumps(ran.json()["scenario"])) == scenario
    help_ = Ran(capsys, "simulate", "--scenario", path, "--help").out
    assert "(default: 30)" in help_


def sweep_flags(*more: object) -> list[object]:
    return ["sweep", "--interaction-ranges", 0, 5.5, 100, "--seeds", "3:40", *SMALL_FLAGS, *more]


def test_a_sweep_is_the_librarys(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    result = sweep(SMALL, [0, 5.5, 100], range(3, 40))
    path = tmp_path / "sweep.parquet"
    ran = Ran(capsys, *sweep_flags("--json", "--output", path, "--objective", "minimum"))
    document = ran.json()
    assert ran.code == Exit.DONE
    mean, low, high = result.mean_with_interval("minimum")
    for row, *expected in zip(
        document["ranges"],
        result.interaction_ranges,
        mean,
        low,
        high,
        result.num_components.mean(axis=1),
        strict=True,
    ):
        assert list(row.values()) == expected
    assert document["best_range"] == result.best_range("minimum")
    assert document["hindsight_oracle"] == result.hindsight_oracle("minimum").mean()
    assert (document["seeds"], document["interrupted"]) == ({"start": 3, "stop": 40}, False)

    other = tmp_path / "library.parquet"
    result.to_parquet(other)
    assert pl.read_parquet(path).equals(pl.read_parquet(other))
    assert pl.read_parquet_metadata(path)["scenario"] == SMALL.to_json()
    Ran(capsys, *sweep_flags("--output", tmp_path / "sweep.csv"))
    assert pl.read_csv(tmp_path / "sweep.csv").equals(result.table().cast({"seed": pl.Int64}))
    assert sorted(entry.name for entry in tmp_path.iterdir()) == [
        "library.parquet",
        "sweep.csv",
        "sweep.parquet",
    ]


def test_the_table_names_the_best_range(capsys: pytest.CaptureFixture[str]) -> None:
    result = sweep(SMALL, [0, 5.5, 100], range(3, 40))
    lines = Ran(capsys, *sweep_flags()).out.splitlines()
    assert len(lines) == 1 + 3 + 1
    assert lines[2].split()[:2] == ["5.5", f"{result.values()[1].mean():.4f}"]
    assert lines[-1].startswith(f"best fixed range: {result.best_range():g} m")


def test_grids_and_models_of_a_sweep(capsys: pytest.CaptureFixture[str]) -> None:
    def ranges(*flags: object) -> list[float]:
        document = Ran(capsys, "sweep", "--seeds", "0:2", *flags, "--json").json()
        return [row["interaction_range"] for row in document["ranges"]]

    assert ranges(*SMALL_FLAGS) == np.linspace(0, 100, 21).tolist()
    assert ranges(*SMALL_FLAGS, "--max-range", 30, "--grid-size", 4) == [0, 10, 20, 30]
    assert ranges("--model", "line", "--num-agents", 9) == np.linspace(0, 1, 21).tolist()


def test_a_sweep_of_a_line_and_of_one_without_a_predator(capsys: pytest.CaptureFixture[str]) -> None:
    flags = [
        "sweep",
        "--model",
        "line",
        "--num-agents",
        9,
        "--seeds",
        "0:5",
        "--interaction-ranges",
        0.1,
        0.5,
    ]
    line = sweep(LineScenario(num_agents=9), [0.1, 0.5], range(5))
    document = Ran(capsys, *flags, "--json").json()
    assert [row["mean"] for row in document["ranges"]] == line.values().mean(axis=1).tolist()
    alone = Ran(capsys, *flags, "--predator-position", "None", "--json").json()
    assert (alone["best_range"], alone["ranges"][0]["mean"]) == (None, None)


def test_replay_tells_whether_runs_match(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    run = simulate(SMALL, 10.0, seed=7)
    same, other, broken = tmp_path / "same.npz", tmp_path / "other.npz", tmp_path / "broken.npz"
    save(run, same)
    velocities = run.velocities.copy()
    velocities[2, 3, 1] = np.nextafter(velocities[2, 3, 1], np.inf)
    save(dataclasses.replace(run, velocities=velocities), other)
    broken.write_bytes(same.read_bytes()[:100])

    matches = Ran(capsys, "replay", same)
    assert (matches.code, matches.out, matches.err) == (Exit.DONE, f"{same}: matches\n", "")
    differs = Ran(capsys, "replay", other, same)
    assert differs.code == Exit.FAILED
    assert f"{other}: differs\n  velocities[2, 3, 1]: recorded" in differs.out
    assert f"{same}: matches" in differs.out
    refused = Ran(capsys, "replay", other, broken, tmp_path / "none.npz", same, "--json")
    assert refused.code == Exit.REFUSED
    reports = refused.json()["files"]
    assert [report["outcome"] for report in reports] == ["differs", "refused", "refused", "matches"]
    assert f"error: {broken}: expected a recorded run" in refused.err
    assert f"error: {tmp_path / 'none.npz'}: No such file" in refused.err


def test_replay_notes_other_versions(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("flockesc_env.records.versions", lambda: {"numpy": "0.9"})
        save(simulate(SMALL, 10.0, seed=7), tmp_path / "old.npz")
    ran = Ran(capsys, "replay", tmp_path / "old.npz")
    assert ran.code == Exit.DONE
    assert "recorded with numpy 0.9; now python" in ran.err


def test_bench_measures_model_and_environments(capsys: pytest.CaptureFixture[str]) -> None:
    document = Ran(capsys, "bench", "--repetitions", 1, "--json").json()
    names = {row["name"] for row in document["results"]}
    assert names == {"model", "Gymnasium", "Gymnasium vector", "PettingZoo step_array"}
    assert all(row["median"] > 0 and len(row["microseconds_per_step"]) == 1 for row in document["results"])


BAD = {
    "field": (
        ["simulate", "--interaction-range", "1", "--num-agents", "0"],
        "num_agents: expected an integer",
    ),
    "predator": (
        ["simulate", "--interaction-range", "1", "--predators", "pure_pursuit", "max_turn_rate=-1"],
        "predators[0].pure_pursuit.max_turn_rate: expected",
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
    "folder": (["sweep", "--output", "nowhere/run.csv"], "output: expected a file in a folder that exists"),
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
        "interaction_ranges: expected either these or a grid, got these and a grid",
    ),
    "grid": (["sweep", "--grid-size", "0"], "grid_size: expected an integer of at least 1"),
    "largest": (["sweep", "--max-range", "-1"], "max_range: expected a number of at least 0, got -1"),
    "objective": (["sweep", "--objective", "escape_distance"], "objective: expected one of mean, minimum"),
    "threads": (["sweep", "--num-threads", "0"], "num_threads: expected an integer of at least 1"),
    "files": (["replay"], "files: expected at least one file, got none"),
    "repetitions": (["bench", "--repetitions", "0"], "repetitions: expected an integer of at least 1"),
    "flag": (["simulate", "--interaction-range", "1", "--num-agent", "4"], "--num-agent"),
    "model": (["simulate", "--interaction-range", "1", "--model", "cube"], "--model"),
    "missing": (["simulate"], "--interaction-range"),
    "kind": (
        ["simulate", "--interaction-range", "1", "--predators", "owl"],
        "constant_velocity or pure_pursuit",
    ),
    "part": (
        ["simulate", "--interaction-range", "1", "--predators", "pure_pursuit", "mass=1"],
        "mass: expected one of position",
    ),
    "text": (
        ["simulate", "--interaction-range", "1", "--predators", "pure_pursuit", "position=a"],
        "position: expected numbers",
    ),
    "no range of seeds": (["sweep", "--seeds", "5"], "expected START:STOP"),
    "command": (["fly"], "simulate, sweep, replay, bench"),
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
        ("= 3", "expected TOML or JSON"),
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
    monkeypatch.setattr("flockesc_env.cli.output.find_spec", lambda _: None)
    ran = Ran(capsys, *sweep_flags("--output", tmp_path / "sweep.parquet"))
    assert ran.code == Exit.REFUSED
    assert (
        "output: expected the analysis extra (pip install 'flockesc-env[analysis]'), got no polars" in ran.err
    )
    monkeypatch.setattr("flockesc_env.cli.sweep.find_spec", lambda _: None)
    ran = Ran(capsys, *sweep_flags("--json"))
    assert ran.code == Exit.DONE
    assert ran.json()["ranges"][0]["low"] is None
    assert "no intervals: they need the analysis extra" in ran.err


@pytest.mark.parametrize("command", COMMANDS)
def test_help_explains_every_flag(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, command, "--help")
    assert (ran.code, ran.err) == (Exit.DONE, "")
    assert f"Example: flockesc {command}" in ran.out
    assert max(map(len, ran.out.splitlines())) <= 80
    _, *entries = re.split(r"\n--(?=[a-z])", plain(ran.out))
    assert entries
    for entry in entries:
        words = " ".join(entry.split())
        mark = next(mark for mark in ("(default: ", "(required)") if mark in words)
        assert len(words.partition(mark)[0].split()) >= 4, words


def plain(boxes: str) -> str:
    """Return the text in tyro's boxes, which are of other letters where the terminal has no Unicode."""
    return "\n".join(line.strip("│|").strip() for line in boxes.splitlines())


def test_flags_have_the_scenarios_defaults(capsys: pytest.CaptureFixture[str]) -> None:
    for model, scenario in (("flock", FlockScenario()), ("line", LineScenario())):
        words = " ".join(plain(Ran(capsys, "simulate", "--model", model, "--help").out).split())
        for field in dataclasses.fields(scenario):
            value = getattr(scenario, field.name)
            if isinstance(value, str | int | float) and not isinstance(value, bool):
                own = words.partition(f"--{field.name.replace('_', '-')} ")[2]
                assert f"(default: {value})" in own.partition(" --")[0]


def test_the_first_help_lists_commands_and_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys)
    assert ran.code == Exit.DONE
    assert ran.out == Ran(capsys, "--help").out
    for command in COMMANDS:
        assert f" {command}  " in ran.out
    for code, meaning in MEANINGS.items():
        assert f"{code.value}  {meaning}" in ran.out
    assert set(MEANINGS) == set(Exit)


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert Ran(capsys, "--version").out == f"flockesc {__version__}\n"


def test_a_process_ends_with_the_code_of_its_command() -> None:
    ran = run_process("sweep", "--seeds", "0:2", *SMALL_FLAGS, "--json", capture_output=True)
    assert (ran.returncode, ran.stderr) == (Exit.DONE, "")
    assert len(json.loads(ran.stdout)["ranges"]) == 21
    ran = run_process("simulate", "--interaction-range", "-1", capture_output=True)
    assert (ran.returncode, ran.stdout) == (Exit.REFUSED, "")
    assert ran.stderr.startswith("flockesc: error: interaction_range")


def test_progress_is_shown_on_request() -> None:
    ran = run_process("sweep", "--seeds", "0:2", *SMALL_FLAGS, "--json", "--progress", capture_output=True)
    assert "42/42" in ran.stderr
    json.loads(ran.stdout)


@pytest.mark.parametrize("output", ["sweep.parquet", "sweep.csv"])
def test_ctrl_c_keeps_what_is_finished(output: str, tmp_path: Path) -> None:
    # A background job inherits no handler for Ctrl-C.
    script = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from flockesc_env.cli import main
sys.exit(main(sys.argv[1:]))
"""
    path = tmp_path / output
    grid = ["--interaction-ranges", "0", "10"]
    flags = [*grid, "--seeds", "0:10000000", "--json", "--progress", "--output", str(path)]
    process = subprocess.Popen(  # noqa: S603
        [sys.executable, "-c", script, "sweep", *flags],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    try:
        assert process.stderr is not None
        # The bar counts runs; the first chunks are small and surely done by a few hundred.
        shown = b""
        while not any(int(word) > 300 for word in _counts(shown)):
            shown += os.read(process.stderr.fileno(), 4096)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=TIMEOUT)
    finally:
        process.kill()
    assert process.returncode == Exit.INTERRUPTED
    document = json.loads(out)
    finished = document["seeds"]["stop"]
    assert document["interrupted"]
    assert 0 < finished < 10_000_000
    assert f"interrupted after {finished} of 10000000 seeds".encode() in err
    assert b"Traceback" not in err
    result = sweep(FlockScenario(), [0, 10], range(finished))
    table = pl.read_parquet(path) if path.suffix == ".parquet" else pl.read_csv(path)
    assert table.equals(
        result.table() if path.suffix == ".parquet" else result.table().cast({"seed": pl.Int64})
    )
    assert [row["mean"] for row in document["ranges"]] == result.values().mean(axis=1).tolist()
    assert [entry.name for entry in tmp_path.iterdir()] == [output]


def _counts(shown: bytes) -> list[bytes]:
    return [word.partition(b"/")[0] for word in shown.split() if b"/20000000" in word]


def test_ctrl_c_before_anything_is_finished(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("flockesc_env.cli.sweep.sweep", interrupt)
    ran = Ran(capsys, *sweep_flags("--output", tmp_path / "sweep.csv"))
    assert (ran.code, ran.out) == (Exit.INTERRUPTED, "")
    assert "interrupted after 0 of 37 seeds" in ran.err
    assert not list(tmp_path.iterdir())
    monkeypatch.setattr("flockesc_env.cli.simulate.simulate", interrupt)
    ran = Ran(capsys, "simulate", "--interaction-range", 1)
    assert (ran.code, ran.out, ran.err) == (Exit.INTERRUPTED, "", "flockesc: interrupted\n")


@pytest.mark.parametrize("argv", [["--help"], ["sweep", "--help"], ["sweep", "--seeds", "0:2", *SMALL_FLAGS]])
def test_a_reader_that_goes_away(argv: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        ran = run_process(*argv, stdout=writing, stderr=subprocess.PIPE)
    finally:
        os.close(writing)
    assert (ran.returncode, ran.stderr) == (Exit.UNREAD, "")


def test_a_full_disk() -> None:
    with Path("/dev/full").open("w") as full:
        ran = run_process("sweep", "--seeds", "0:2", *SMALL_FLAGS, stdout=full, stderr=subprocess.PIPE)
    assert (ran.returncode, ran.stderr) == (
        Exit.REFUSED,
        "flockesc: error: output: No space left on device\n",
    )


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
@pytest.mark.parametrize("argv", [["--help"], ["sweep", "--seeds", "0:2", *SMALL_FLAGS]])
def test_closed_streams(argv: list[str], closed: str) -> None:
    command = ["sh", "-c", f'"$@" {closed}', "sh", *FLOCKESC, *argv]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)  # noqa: S603
    assert (ran.returncode, ran.stderr) == (Exit.DONE, "")
    assert bool(ran.stdout) == (">&-" not in closed.replace("2>&-", ""))


def test_a_terminal_without_unicode(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii:strict"}
    ran = run_process("--help", capture_output=True, env=environment)
    assert (ran.returncode, ran.stderr) == (Exit.DONE, "")
    path = tmp_path / "f\u00f6n.npz"
    save(simulate(SMALL, 10.0, seed=7), path)
    ran = run_process("replay", path, capture_output=True, env=environment)
    assert (ran.returncode, ran.stdout) == (Exit.DONE, f"{tmp_path}/f?n.npz: matches\n")
