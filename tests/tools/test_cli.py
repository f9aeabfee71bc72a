"""The command line gives the results of the library, names bad input first, and explains every flag."""

import dataclasses
import html
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from cli_runs import SMALL, SMALL_FLAGS, Cli, plain, policy_file, run_process, sweep_flags
from PIL import Image

import flockesc_env as fe
from flockesc_env.cli import COMMANDS
from flockesc_env.cli.output import MEANINGS, Exit
from flockesc_env.models.records import load_run, run_differences, save_run
from flockesc_env.scenario import AlignedHeadings, Herd, Intercept, PurePursuit, Ring, Vicsek


def test_a_simulation_without_a_range_takes_the_best_fixed_one(cli: Cli) -> None:
    (scale,) = fe.tasks["per-agent-visible"].scales.values()
    document = cli("simulate", "--seed", 7, *SMALL_FLAGS, "--json").json()
    assert document["policy"] == f"fixed:{scale.best_fixed_range:g}"
    assert document["min_mean_distance"] == fe.simulate(SMALL, 12.0, seed=7).mean_distance.min()


@pytest.mark.parametrize(
    ("spec", "predator"), [("stubborn-leaders", None), ("mine.NPZ", None), ("fixed:9", "pursue")]
)
def test_a_simulation_equals_the_librarys(
    spec: str, predator: str | None, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    is_file = spec.endswith("NPZ")  # knows its scenario
    policy = fe.load_policy(policy_file(Path(spec)) if is_file else spec)
    flags = [*([] if is_file else SMALL_FLAGS), *(["--predator", predator] if predator else [])]
    scenario = SMALL.with_learned_predators() if predator else SMALL
    document = cli("simulate", spec, "--seed", 7, *flags, "--json", "--output", "run.npz").json()
    run, saved = fe.simulate(scenario, policy=policy, seed=7, predator_policy=predator), load_run("run.npz")
    assert (document["policy"], saved.name) == (spec, spec)
    assert fe.FlockScenario.from_json(json.dumps(document["scenario"])) == scenario
    outcomes = {"min_mean_distance": run.mean_distance.min(), "min_min_distance": run.min_distance.min()}
    outcomes |= {name: getattr(run, name)[-1] for name in ("num_components", "polarization")}
    assert document.items() >= outcomes.items()
    for_people = cli("simulate", spec, "--seed", 7, *flags).out
    assert f"{run.mean_distance.min():.3f}" in for_people
    assert "J_mean" in for_people
    assert run_differences(saved.trajectory, run) == []
    assert cli("replay", "run.npz").code == Exit.DONE
    other = ("--scenario", "flock-1000", "--set", "num_steps=2")
    assert cli("simulate", spec, *other, "--json").json()["scenario"]["num_agents"] == 1000


PURSUER = PurePursuit((90.0, 90.0), max_turn_rate=2.0, target="centroid")
CHANGED: dict[str, tuple[list[str], fe.FlockScenario | fe.LineScenario]] = {
    "predators": (
        [
            'predators=[{"pure_pursuit": {"position": [90, 90]}}, {"intercept": {}}, {"herd": {}}]',
            "predators.2.max_speed=20",
            "predators.0.max_turn_rate=2",
            "predators.0.pure_pursuit.target=centroid",
            "predators.2.max_speed=null",
            "predators.1.velocity.0=3",
        ],
        SMALL.replace(predators=(PURSUER, Intercept(velocity=(3.0, 10.0)), Herd())),
    ),
    "kinds": (
        ["initial_positions=ring", "initial_positions.radius=9", "initial_headings=aligned", "motion=vicsek"],
        SMALL.replace(initial_positions=Ring(9.0), initial_headings=AlignedHeadings(), motion=Vicsek()),
    ),
    "line": (
        ["predator_position=None", "escape_force=constant"],
        fe.LineScenario(num_agents=12, predator_position=None, escape_force="constant"),
    ),
}


@pytest.mark.parametrize("name", CHANGED)
def test_every_kind_of_field_can_be_set(name: str, cli: Cli) -> None:
    changes, scenario = CHANGED[name]
    is_line = isinstance(scenario, fe.LineScenario)
    own = ["--scenario", "paper-line", *SMALL_FLAGS[:2]] if is_line else SMALL_FLAGS
    flags = [word for change in changes for word in ("--set", change)]
    ran = cli("simulate", "fixed:0.3", "--seed", 1, *own, *flags, "--json")
    assert ran.json()["model"] == ("line" if is_line else "flock")
    assert type(scenario).from_json(json.dumps(ran.json()["scenario"])) == scenario


@pytest.mark.parametrize(("suffix", "encoding"), [(".TOML", "utf-8-sig"), (".json", "utf-8")])
def test_a_scenario_of_a_file_is_changed(suffix: str, encoding: str, cli: Cli, tmp_path: Path) -> None:
    path, pursuer = tmp_path / f"storm{suffix}", PurePursuit(velocity=(12.0, 0.0))
    scenario = SMALL.replace(num_agents=3, mass=(0.1, 1.0, 2.0), predators=(pursuer,))
    written = scenario.replace(num_steps=30)
    path.write_text(written.to_toml() if suffix == ".TOML" else written.to_json(), encoding)
    flags = ["--scenario", path, "--set", "num_steps=9", "--seed", 1]
    document = cli("simulate", "fixed:3", *flags, "--json").json()
    assert fe.FlockScenario.from_json(json.dumps(document["scenario"])) == scenario


def test_a_sweep_equals_the_librarys(cli: Cli, tmp_path: Path) -> None:
    result = fe.sweep(SMALL, [0, 5.5, 100], range(3, 40))
    path = tmp_path / "sweep.parquet"
    ran = cli(*sweep_flags("--json", "--output", path, "--objective", "min_min_distance"))
    document = ran.json()
    assert ran.code == Exit.DONE
    mean, low, high = result.mean_with_interval("min_min_distance")
    columns = (result.interaction_ranges, mean, low, high, result.num_components.mean(axis=1))
    assert [list(row.values()) for row in document["ranges"]] == np.transpose(columns).tolist()
    found = [document["best_range"], *document["best_range_interval"]]
    assert found == [*result.best_range_with_interval("min_min_distance")]
    assert ("longer ranges may be better" in ran.err) == (found[2] == 100)
    assert document["hindsight_oracle"] == result.hindsight_oracle("min_min_distance").mean()
    assert document["seeds"] == {"start": 3, "stop": 40}

    rows = cli(*sweep_flags("--objective", "min_min_distance")).out.splitlines()
    (marked,) = [row for row in rows if row.lstrip().startswith("* ") and "seed" not in row]
    assert float(marked.split()[1]) == result.best_range("min_min_distance")

    assert pl.read_parquet(path).equals(result.table())
    cli(*sweep_flags("--output", tmp_path / "sweep.CSV"))
    written = pl.read_csv(tmp_path / "sweep.CSV", comment_prefix="#")
    assert written.equals(result.table().cast({"seed": pl.Int64}))
    assert len(list(tmp_path.iterdir())) == 2


def origin_in(path: Path) -> dict[str, str]:
    """Return where a file of results says that it comes from."""
    if path.suffix == ".parquet":
        found = pl.read_parquet_metadata(path)
        return {name: found[name] for name in ("version", "command", "scenario", "seeds")}
    if path.suffix == ".csv":
        text = path.read_text().partition("\n")[0].removeprefix("# ")
    elif path.suffix == ".png":
        text = Image.open(path).text["Description"]
    else:
        text = html.unescape(re.search("<dc:description>(.*?)</dc:description>", path.read_text())[1])
    return json.loads(text)


@pytest.mark.parametrize("suffix", [".parquet", ".csv", ".png", ".svg"])
def test_files_say_where_they_come_from(
    suffix: str, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"found{suffix}"
    monkeypatch.setattr(sys, "argv", ["/somewhere/flockesc", "x y"])
    expected = {"version": fe.__version__, "command": "flockesc 'x y'", "scenario": SMALL.to_json()}
    flags = ("--values", "speed=5,10", "--interaction-range", "9", "--seeds", "3:40")
    for command in (sweep_flags(), ["scan", *SMALL_FLAGS, *flags]):
        assert cli(*command, "--output", path).code == Exit.DONE
        assert origin_in(path) == {**expected, "seeds": "3:40"}


def test_a_scan_equals_the_librarys(cli: Cli) -> None:
    flags = ["scan", *SMALL_FLAGS, "--values", "speed=5,10", "--values", "mass=0.1,0.2"]
    flags += ["--interaction-range", "9", "3", "--seeds", "4", "--skip", "2"]
    flags += ["--measures", "rotation", "num_components"]
    given: Any = {"measures": ("rotation", "num_components"), "skip": 2}
    result = fe.scan(SMALL, {"speed": [5, 10], "mass": [0.1, 0.2]}, [9, 3], range(4), **given)
    ran = cli(*flags, "--json")
    for name, found in ran.json()["measured"].items():
        expected = {**result.values, **result.summary(name)}
        assert found == {key: [None if np.isnan(x) else x for x in row] for key, row in expected.items()}
    assert ran.err.count("steps for a time of") == sum(len(result.notes(name)) for name in result.series) > 0
    shown = cli(*flags).out.splitlines()
    assert (shown[0], shown[4], shown[7].split()[:3]) == ("rotation", "num_components", ["10", "0.2", "3"])


def test_a_curve_has_its_own_style(cli: Cli, tmp_path: Path) -> None:
    settings = tmp_path / "matplotlibrc"
    settings.write_text("text.usetex: True\nfont.family: No Such Font\nsavefig.facecolor: red\n")
    environment = {**os.environ, "MATPLOTLIBRC": str(settings), "MPLBACKEND": "nonsense"}
    ran = run_process(*sweep_flags("--output", tmp_path / "user.png"), env=environment, capture_output=True)
    assert ran.returncode == Exit.DONE, ran.stderr
    cli(*sweep_flags("--output", tmp_path / "own.png"))
    user, own = (np.asarray(Image.open(tmp_path / name)) for name in ("user.png", "own.png"))
    np.testing.assert_array_equal(user, own)  # their metadata name two commands


def test_a_sweep_of_a_line_and_of_one_without_a_predator(cli: Cli, tmp_path: Path) -> None:
    flags = ["sweep", "--scenario", "paper-line", "--set", "num_agents=9"]
    flags += ["--seeds", "5", "--interaction-ranges", "0.1", "0.5"]
    line = fe.sweep(fe.LineScenario(num_agents=9), [0.1, 0.5], range(5))
    document = cli(*flags, "--json").json()
    assert [row["mean"] for row in document["ranges"]] == line.values().mean(axis=1).tolist()
    alone = cli(*flags, "--set", "predator_position=None", "--json").json()
    assert (alone["best_range"], alone["ranges"][0]["mean"]) == (None, None)
    curve = cli(*flags, "--set", "predator_position=None", "--output", tmp_path / "curve.png")
    assert curve.code == Exit.REFUSED
    assert "output: expected a .parquet or .csv file" in curve.err


def test_replay_prints_whether_runs_match(cli: Cli, tmp_path: Path) -> None:
    run = fe.simulate(SMALL, 10.0, seed=7)
    same, other, broken = tmp_path / "same.npz", tmp_path / "other.npz", tmp_path / "broken.npz"
    save_run(run, same)
    velocities = run.velocities.copy()
    velocities[2, 3, 1] = np.nextafter(velocities[2, 3, 1], np.inf)
    save_run(dataclasses.replace(run, velocities=velocities), other)
    broken.write_bytes(same.read_bytes()[:100])

    differs = cli("replay", other, same)
    assert (differs.code, differs.err) == (Exit.FAILED, "")
    assert f"{other}: differs\n  velocities[2, 3, 1]: recorded" in differs.out
    assert differs.out.endswith(f"{same}: matches\n")
    refused = cli("replay", other, broken, tmp_path / "none.npz", same)
    assert refused.code == Exit.REFUSED
    outcomes = [
        line.rpartition(": ")[2] for line in refused.out.splitlines() if line.startswith(str(tmp_path))
    ]
    assert outcomes == ["differs", "refused", "refused", "matches"]
    assert f"error: {broken}: expected a recorded run" in refused.err
    assert f"error: {tmp_path / 'none.npz'}: No such file" in refused.err


@pytest.mark.parametrize("model", [[], ["--scenario", "paper-line"]])
def test_a_sweep_of_jobs_is_the_librarys(model: list[str], cli: Cli, tmp_path: Path) -> None:
    flags = ["sweep", *model, "--interaction-ranges", "0", "0.2", "--seeds", "3:70", "--json"]
    flags += ["--set", "num_agents=12"]
    jobs = ["--backend", "serial", "--cache", str(tmp_path / "cache")]
    first, again = (cli(*flags, *jobs) for _ in range(2))
    assert first.code == Exit.DONE, first.err
    assert first.json() == again.json() == cli(*flags).json()
    assert list((tmp_path / "cache").glob("*.npz"))
    refused = cli(*flags, *jobs, "--num-threads", 2)
    assert refused.code == Exit.REFUSED
    assert "num_threads" in refused.err


@pytest.fixture(autouse=True)
def _narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def _set(change: str) -> list[str]:
    return ["simulate", "fixed:1", "--set", change]


DRAWN = '[{"uniform": {"field": "predator_range", "low": 1, "high": 2}}]'
DIGIT = "\N{ARABIC-INDIC DIGIT ONE}"
BAD: list[tuple[list[str], str]] = [
    (["wacth"], "replay, tasks, compare, score, verify, got 'wacth' (did you mean watch?)"),
    (_set("num_agent=1"), "got 'num_agent' (did you mean num_agents?)"),
    (_set("predators.0.max_turn=1"), "predators.0.max_turn: expected one of position"),
    (["simulate", "--num-agent", "5"], "a field of the scenario; set it with --set num_agents=VALUE"),
    ([*_set("predator_range=5"), "--set", f"randomization={DRAWN}"], "that randomization does not draw"),
    (["simulate", "--scenario", "paper-line"], "policy: expected fixed:RHO for a line, got none"),
    (["simulate", "fixed:1", "--scenario", "none.toml"], "none.toml: No such file"),
    (["simulate", "math:pi"], "policy: expected one of fixed:RHO"),
    (["simulate", "--seed", "1_0"], "expected an integer, got '1_0'"),
    (["simulate", f"fixed:{DIGIT}"], f"got 'fixed:{DIGIT}'"),
    (
        ["simulate", "fixed:-3"],
        "expected fixed:RHO with a finite number RHO >= 0, such as fixed:10, got 'fixed:-3'",
    ),
    (["sweep", "--seeds", "4:4"], "N >= 1, or START:STOP with 0 <= START < STOP <= 2^64, got '4:4'"),
    (["sweep", "--seeds", "0"], "N >= 1, or START:STOP with 0 <= START < STOP <= 2^64, got '0'"),
    (["sweep", "--seeds", "0:1_0"], "START < STOP <= 2^64, got '0:1_0'"),
    (["sweep", "--seeds", "0:4:2"], "START < STOP <= 2^64, got '0:4:2'"),
    (["sweep", "--interaction-ranges", "1", "--max-range", "3"], "expected either ranges or a grid"),
    (["scan", "--interaction-range", "1", "--values", "speed"], "values: expected PATH=NUMBER,NUMBER,.."),
    (["sweep", "--output", "nowhere/run.csv"], "output: expected a file in an existing folder"),
]


@pytest.mark.parametrize(("argv", "message"), BAD)
def test_bad_input_is_named(
    argv: list[str], message: str, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = cli(*argv)
    assert (ran.code, ran.out) == (Exit.REFUSED, "")
    assert message in " ".join(plain(ran.err).split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_explains_every_flag(name: str, cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = cli(name, "--help")
    assert (ran.code, ran.err) == (Exit.DONE, "")
    assert f"Example: flockesc {name}" in ran.out
    assert max(map(len, ran.out.splitlines())) <= 80
    assert len(ran.out.splitlines()) <= 60
    monkeypatch.setenv("COLUMNS", "60")
    shown = [*cli(name, "--help").out.splitlines(), *cli("--help").out.splitlines()]
    assert max(map(len, shown)) <= 60
    _, *entries = re.split(r"\n--(?=[a-z])", plain(ran.out))
    assert entries or name in {"presets", "replay", "tasks"}
    for entry in entries:
        words = " ".join(entry.split())
        mark = next(mark for mark in ("(default: ", "(required)") if mark in words)
        assert len(words.partition(mark)[0].split()) >= 4, words


def test_the_first_help_lists_commands_and_exit_codes(cli: Cli) -> None:
    ran = cli()
    assert (ran.code, ran.out) == (Exit.DONE, cli("--help").out)
    assert all(f" {command}  " in ran.out for command in COMMANDS)
    words = " ".join(ran.out.split())
    assert all(f"{code.value} {meaning}" in words for code, meaning in MEANINGS.items())


@pytest.mark.parametrize(("value", "is_colored"), [("1", False), ("", True)])
def test_no_color_turns_colors_off(
    value: str, is_colored: bool, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_COLOR", value)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert ("\x1b[" in cli("presets", "--help").out) == is_colored


def test_commands_start_in_a_deleted_folder(tmp_path: Path) -> None:
    program = str(Path(sys.executable).with_name("flockesc"))
    command = ["sh", "-c", 'cd "$1" && rmdir "$1" && exec "$2" --version', "sh", str(tmp_path), program]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    assert (ran.returncode, ran.stdout) == (Exit.DONE, f"flockesc {fe.__version__}\n"), ran.stderr
