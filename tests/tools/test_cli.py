"""The command line gives the same results as the library, and its files replay."""

import dataclasses
import json
import os
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_runs import SMALL, SMALL_FLAGS, Ran, policy_file, run_process, sweep_flags

import flockesc_env as fe
from flockesc_env.cli.output import Exit
from flockesc_env.models.records import load_run, save_run
from flockesc_env.scenario import AlignedHeadings, Herd, Intercept, PurePursuit, Ring, Vicsek
from flockesc_env.tasks import tasks


def test_a_simulation_equals_the_librarys(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    flags = ["fixed:10", "--seed", 7, *SMALL_FLAGS]
    ran = Ran(capsys, "simulate", *flags, "--json", "--output", path)
    run = fe.simulate(SMALL, 10.0, seed=7)
    document = ran.json()
    assert ran.code == Exit.DONE
    assert document["min_mean_distance"] == run.mean_distance.min()
    assert document["min_min_distance"] == run.min_distance.min()
    assert document["num_components"] == run.num_components[-1]
    assert document["polarization"] == run.polarization[-1]
    assert fe.FlockScenario.from_json(json.dumps(document["scenario"])) == SMALL
    np.testing.assert_array_equal(load_run(path).trajectory.positions, run.positions)

    for_people = Ran(capsys, "simulate", *flags).out
    assert f"{run.mean_distance.min():.3f}" in for_people
    assert "J_mean" in for_people


def test_a_simulation_without_a_range_takes_the_best_fixed_one(capsys: pytest.CaptureFixture[str]) -> None:
    (scale,) = tasks["per-agent-visible"].scales.values()
    document = Ran(capsys, "simulate", "--seed", 7, *SMALL_FLAGS, "--json").json()
    assert document["policy"] == f"fixed:{scale.best_fixed_range:g}"
    assert document["min_mean_distance"] == fe.simulate(SMALL, 12.0, seed=7).mean_distance.min()


@pytest.mark.parametrize("spec", ["stubborn-leaders", "mine.NPZ"])
def test_a_policy_is_simulated(
    spec: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    policy = fe.load_policy(policy_file(Path(spec))) if spec.endswith("NPZ") else fe.load_policy(spec)
    path = tmp_path / "run.npz"
    document = Ran(capsys, "simulate", spec, "--seed", 7, *SMALL_FLAGS, "--json", "--output", path).json()
    run, saved = fe.simulate(SMALL, policy=policy, seed=7), load_run(path)
    assert (document["policy"], saved.name) == (spec, spec)
    assert document["min_mean_distance"] == run.mean_distance.min()
    np.testing.assert_array_equal(saved.trajectory.positions, run.positions)
    np.testing.assert_array_equal(saved.trajectory.interaction_ranges, run.interaction_ranges)
    assert Ran(capsys, "replay", path).code == Exit.DONE


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
        SMALL.replace(
            predators=(
                PurePursuit((90.0, 90.0), max_turn_rate=2.0, target="centroid"),
                Intercept(velocity=(3.0, 10.0)),
                Herd(),
            )
        ),
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
def test_every_kind_of_field_can_be_set(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    changes, scenario = CHANGED[name]
    is_line = isinstance(scenario, fe.LineScenario)
    own = ["--scenario", "paper-line", *SMALL_FLAGS[:2]] if is_line else SMALL_FLAGS
    flags = [word for change in changes for word in ("--set", change)]
    ran = Ran(capsys, "simulate", "fixed:0.3", "--seed", 1, *own, *flags, "--json")
    assert ran.json()["model"] == ("line" if is_line else "flock")
    assert type(scenario).from_json(json.dumps(ran.json()["scenario"])) == scenario


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig"])
@pytest.mark.parametrize("suffix", [".TOML", ".json"])
def test_a_scenario_comes_from_a_file_and_is_changed(
    suffix: str, encoding: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path, pursuer = tmp_path / f"storm{suffix}", PurePursuit(velocity=(12.0, 0.0))
    scenario = SMALL.replace(num_agents=3, mass=(0.1, 1.0, 2.0), predators=(pursuer,))
    written = scenario.replace(num_steps=30)
    path.write_text(written.to_toml() if suffix == ".TOML" else written.to_json(), encoding)
    flags = ["--scenario", path, "--set", "num_steps=9", "--seed", 1]
    document = Ran(capsys, "simulate", "fixed:3", *flags, "--json").json()
    assert fe.FlockScenario.from_json(json.dumps(document["scenario"])) == scenario


def test_a_sweep_equals_the_librarys(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    result = fe.sweep(SMALL, [0, 5.5, 100], range(3, 40))
    path = tmp_path / "sweep.parquet"
    ran = Ran(capsys, *sweep_flags("--json", "--output", path, "--objective", "min_min_distance"))
    document = ran.json()
    assert ran.code == Exit.DONE
    mean, low, high = result.mean_with_interval("min_min_distance")
    columns = (result.interaction_ranges, mean, low, high, result.num_components.mean(axis=1))
    assert [list(row.values()) for row in document["ranges"]] == np.transpose(columns).tolist()
    assert document["best_range"] == result.best_range("min_min_distance")
    assert document["hindsight_oracle"] == result.hindsight_oracle("min_min_distance").mean()
    assert (document["seeds"], document["interrupted"]) == ({"start": 3, "stop": 40}, False)

    rows = Ran(capsys, *sweep_flags("--objective", "min_min_distance")).out.splitlines()
    (marked,) = [row for row in rows if row.lstrip().startswith("* ") and "[" in row]
    assert float(marked.split()[1]) == result.best_range("min_min_distance")

    other = tmp_path / "library.parquet"
    result.to_parquet(other)
    assert pl.read_parquet(path).equals(pl.read_parquet(other))
    assert pl.read_parquet_metadata(path)["scenario"] == SMALL.to_json()
    Ran(capsys, *sweep_flags("--output", tmp_path / "sweep.CSV"))
    assert pl.read_csv(tmp_path / "sweep.CSV").equals(result.table().cast({"seed": pl.Int64}))
    for name, start in (("curve.PNG", b"\x89PNG"), ("curve.svg", b"<?xml")):
        Ran(capsys, *sweep_flags("--output", tmp_path / name))
        assert (tmp_path / name).read_bytes().startswith(start)
    assert len(list(tmp_path.iterdir())) == 5


def test_a_curve_has_its_own_style(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    settings = tmp_path / "matplotlibrc"
    settings.write_text("text.usetex: True\nfont.family: No Such Font\nsavefig.facecolor: red\n")
    environment = {**os.environ, "MATPLOTLIBRC": str(settings), "MPLBACKEND": "nonsense"}
    ran = run_process(*sweep_flags("--output", tmp_path / "user.png"), env=environment, capture_output=True)
    assert ran.returncode == Exit.DONE, ran.stderr
    Ran(capsys, *sweep_flags("--output", tmp_path / "own.png"))
    assert (tmp_path / "user.png").read_bytes() == (tmp_path / "own.png").read_bytes()


def test_a_sweep_of_a_line_and_of_one_without_a_predator(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    flags = ["sweep", "--scenario", "paper-line", "--set", "num_agents=9"]
    flags += ["--seeds", "0:5", "--interaction-ranges", "0.1", "0.5"]
    line = fe.sweep(fe.LineScenario(num_agents=9), [0.1, 0.5], range(5))
    document = Ran(capsys, *flags, "--json").json()
    assert [row["mean"] for row in document["ranges"]] == line.values().mean(axis=1).tolist()
    alone = Ran(capsys, *flags, "--set", "predator_position=None", "--json").json()
    assert (alone["best_range"], alone["ranges"][0]["mean"]) == (None, None)
    curve = Ran(capsys, *flags, "--set", "predator_position=None", "--output", tmp_path / "curve.png")
    assert curve.code == Exit.REFUSED
    assert "output: expected a .parquet or .csv file" in curve.err


def test_replay_prints_whether_runs_match(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    run = fe.simulate(SMALL, 10.0, seed=7)
    same, other, broken = tmp_path / "same.npz", tmp_path / "other.npz", tmp_path / "broken.npz"
    save_run(run, same)
    velocities = run.velocities.copy()
    velocities[2, 3, 1] = np.nextafter(velocities[2, 3, 1], np.inf)
    save_run(dataclasses.replace(run, velocities=velocities), other)
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


@pytest.mark.parametrize("model", [[], ["--scenario", "paper-line"]])
def test_a_sweep_of_jobs_is_the_librarys(
    model: list[str], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    flags = ["sweep", *model, "--interaction-ranges", "0", "0.2", "--seeds", "3:70", "--json"]
    flags += ["--set", "num_agents=12"]
    jobs = ["--backend", "serial", "--cache", str(tmp_path / "cache")]
    first, again = (Ran(capsys, *flags, *jobs) for _ in range(2))
    assert first.code == Exit.DONE, first.err
    assert first.json() == again.json() == Ran(capsys, *flags).json()
    assert list((tmp_path / "cache").glob("*.npz"))
    refused = Ran(capsys, *flags, *jobs, "--num-threads", 2)
    assert refused.code == Exit.REFUSED
    assert "num_threads" in refused.err
