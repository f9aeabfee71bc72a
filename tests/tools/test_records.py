"""Recorded runs: files load bit for bit, replay to the same bits, and errors name the damage."""

import dataclasses
import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from argument_table import FLOCK as SMALL
from argument_table import PARTS, SLOTS
from same import same
from watch_documents import FLOCK
from watch_documents import RUNS as SHOWN

import flockesc_env as fe
from flockesc_env.models.records import load_run, replay_run, run_differences, save_run, versions
from flockesc_env.scenario import Learned, Wandering

RANDOM = (Wandering(angular_diffusion=2.0),)


def with_part(slot: str, part: Any) -> fe.models.Trajectory:
    return fe.simulate(SMALL.replace(**{slot: SLOTS[slot][0](part)}), 2.0, seed=3)


RUNS = {
    **SHOWN,
    "unseeded": lambda: fe.simulate(FLOCK, 10.0),
    "per agent": lambda: fe.simulate(FLOCK, np.linspace(0, 30, 12), seed=3),
    "random predator": lambda: fe.simulate(FLOCK.replace(predators=RANDOM), 20.0, seed=1),
    "random predator, given start": lambda: fe.simulate(
        FLOCK.replace(predators=RANDOM), 20.0, initial_velocities=np.ones((12, 2))
    ),
    "learned predator": lambda: fe.simulate(FLOCK.replace(predators=(Learned(),)), 10.0, seed=3),
    "line": lambda: fe.simulate_line(fe.LineScenario(), 0.1, seed=3),
    "line, given": lambda: fe.simulate_line(fe.LineScenario(num_agents=3), 0.1, initial_state=[0.1, 0.5, 1]),
    "line, no predator": lambda: fe.simulate_line(fe.LineScenario(predator_position=None), 0.2, seed=3),
    **{f"part {case.id}": partial(with_part, *case.values) for case in PARTS},
}


@pytest.mark.parametrize("name", RUNS)
def test_saved_runs_load_and_replay(name: str, tmp_path: Path) -> None:
    run = RUNS[name]()
    path = tmp_path / "run.npz"
    save_run(run, path, name=name)
    loaded = load_run(path)
    assert loaded.name == name
    assert loaded.versions == versions()
    back = loaded.trajectory
    assert type(back) is type(run)
    assert back.scenario == run.scenario
    same(back, run)
    assert run_differences(back, replay_run(back)) == []
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"positions": None}, "columns"),
        ({"positions": np.zeros((10, 12, 3))}, "positions"),
        ({"positions": np.zeros((10, 12, 2), np.float32)}, "positions"),
        ({"header": np.array("no json")}, "header"),
        ({"header": np.array(json.dumps({"model": "fish"}))}, "header"),
        ({"header": np.array('{"name": "one", "versions": {"numpy": "1", "numpy": "2"}}')}, "header"),
    ],
)
def test_a_file_of_another_format_is_named(changes: dict[str, Any], field: str, tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    save_run(fe.simulate(FLOCK, 10.0, seed=3), path)
    columns = {**np.load(path), **changes}
    np.savez(path, **{name: value for name, value in columns.items() if value is not None})
    with pytest.raises(fe.InputError, check=lambda error: error.field == field):
        load_run(path)


@pytest.mark.parametrize(
    ("name", "column", "bad"),
    [
        *(("random predator", name, np.nan) for name in ("positions", "velocities", "predator_positions")),
        *(("random predator", name, -1) for name in ("times", "interaction_ranges", "mean_distance")),
        *(("random predator", name, -1) for name in ("min_distance", "polarization", "num_components")),
        ("learned predator", "predator_actions", np.inf),
        ("random predator", "num_components", 13),
        ("random predator", "caught_at", 10),
        ("random predator", "fraction_surviving", 1.5),
        ("no predator", "mean_distance", np.nan),
        ("line", "states", np.nan),
        *(("line", name, -1) for name in ("interaction_range", "num_components", "escape_distance", "steps")),
        ("line, no predator", "escape_distance", np.nan),
    ],
)
def test_impossible_numbers_are_named(name: str, column: str, bad: float, tmp_path: Path) -> None:
    path, run = tmp_path / "run.npz", RUNS[name]()
    values = np.array(getattr(run, column))
    values.flat[-1] = bad
    save_run(dataclasses.replace(run, **{column: values}), path)
    with pytest.raises(fe.InputError, check=lambda error: error.field.partition("[")[0] == column):
        load_run(path)
