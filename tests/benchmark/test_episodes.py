"""Data sets of episodes: replays give the same bits, files are complete, metadata describes them."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from cli_runs import Ran

from flockesc_env import NamedPolicy, PolicySpec, __version__
from flockesc_env.benchmark.croissant import KEYS
from flockesc_env.benchmark.episodes import environment, minari_ids, record_episodes
from flockesc_env.benchmark.scoring import LoadedPolicy
from flockesc_env.benchmark.seeds import HELD_OUT, TRAINING
from flockesc_env.benchmark.tasks import Shortcut, task_of
from flockesc_env.cli.application import Application
from flockesc_env.cli.episodes import run
from flockesc_env.common.errors import ArgumentError

ROOT = Path(__file__).parents[2]
GRID = (0.0, 0.1, 0.35, 1.0)


class Alternate:
    """Chooses the entries of a grid one after another; fails when episode ``fails_in`` starts."""

    def __init__(self, fails_in: int | None = None) -> None:
        self.fails_in, self.episodes, self.actions = fails_in, 0, 0

    def reset(self, rows: np.ndarray) -> None:
        if self.episodes == self.fails_in:
            raise RuntimeError("no more")
        self.episodes, self.actions = self.episodes + 1, 0

    def act(self, observations: np.ndarray, spec: PolicySpec) -> np.ndarray:
        self.actions += 1
        return np.full(len(observations), self.actions % len(GRID))


def alternate(fails_in: int | None = None) -> LoadedPolicy:
    options = {"action_mode": "discrete", "range_grid": GRID, "reward": "terminal"}
    return LoadedPolicy(
        "module:alternate", "", NamedPolicy("alternate", Alternate(fails_in), options=options)
    )


def record(task: str, output: Path, *policies: str | LoadedPolicy, flocks: int = 2) -> None:
    found = [LoadedPolicy.of(each) if isinstance(each, str) else each for each in policies]
    record_episodes(found, task_of(task), TRAINING[:flocks], output)


def options(folder: Path) -> dict[str, dict[str, Any]]:
    facts = pl.read_parquet(folder / "policies.parquet")
    return {name: json.loads(text) for name, text in facts.select("policy", "options").iter_rows()}


@pytest.mark.parametrize(
    ("task", "policy"),
    [
        ("shared", "random"),
        ("per-agent-visible", "stubborn-leaders"),
        ("per-agent-visible", "fixed:12"),
        ("line", alternate()),
    ],
)
def test_replayed_actions_give_the_recorded_bits(task: str, policy: Any, tmp_path: Path) -> None:
    record(task, tmp_path / "data", policy)
    ((name, chosen),) = options(tmp_path / "data").items()
    rows = pl.read_parquet(tmp_path / "data" / f"{name}.parquet")
    ends = pl.read_parquet(tmp_path / "data" / "episodes.parquet")
    env = environment(task, **{**chosen, "action_mode": "normalized"})
    for seed, end in zip(TRAINING, ends.iter_rows(named=True), strict=False):
        observation, _ = env.reset(seed=seed)
        steps = rows.filter(seed=seed).partition_by("step", maintain_order=True)
        for step in steps:
            np.testing.assert_array_equal(step["observation"].to_numpy(), np.atleast_2d(observation))
            action = step["action"].to_numpy()[:, np.newaxis]
            observation, *results, info = env.step(action if "agent" in step.columns else action[0])
            for column, result in zip(("reward", "terminated", "truncated"), results, strict=True):
                np.testing.assert_array_equal(step[column].to_numpy(), np.atleast_1d(result))
            np.testing.assert_array_equal(
                step["range"].to_numpy(), np.atleast_1d(info["interaction_range"]).astype(np.float32)
            )
        assert (step["terminated"] | step["truncated"]).all()
        assert end["steps"] == len(steps)
        assert end["objective"] == np.atleast_1d(info[task_of(task).spec.column])[0]
        np.testing.assert_array_equal(np.float32(end["last_observation"]), np.ravel(observation))


def test_a_policy_of_another_action_mode_and_reward_is_recorded_like_the_others(tmp_path: Path) -> None:
    record("line", tmp_path / "data", alternate())
    rows = pl.read_parquet(tmp_path / "data" / "alternate.parquet")
    errors = np.abs(rows["range"].to_numpy()[:, np.newaxis] - GRID).min(axis=1)
    assert errors.max() < 1e-7  # actions are rounded to float32
    assert (rows["reward"] != 0).sum() > rows["seed"].n_unique()


def test_a_policy_that_sees_less_than_the_task_allows_still_does(tmp_path: Path) -> None:
    names = ("random", "stubborn-leaders-local", "stubborn-leaders")
    record("per-agent-visible", tmp_path / "data", *names, flocks=1)
    chosen = options(tmp_path / "data")
    task = task_of("per-agent-visible").options
    assert chosen["random"] == chosen["stubborn-leaders"] == dict(task)
    assert chosen["stubborn-leaders-local"] == {**task, "predator_sensing_range": "predator_range"}


def test_rows_are_in_order_over_all_parts(tmp_path: Path) -> None:
    """A part has ten lines."""
    record("line", tmp_path / "data", "random", "fixed:0.3", flocks=21)
    keys = pl.read_parquet(tmp_path / "data" / "random.parquet").select("seed", "step")
    assert keys["seed"].unique(maintain_order=True).to_list() == list(TRAINING[:21])
    assert keys.equals(keys.sort("seed", "step"))
    ends = pl.read_parquet(tmp_path / "data" / "episodes.parquet")
    assert ends["policy"].to_list() == ["random"] * 21 + ["fixed-0-3"] * 21


@pytest.mark.parametrize("exists", [False, True])
def test_a_run_that_ends_early_leaves_what_was_there(exists: bool, tmp_path: Path) -> None:
    if exists:
        (tmp_path / "data").mkdir(mode=0o700)
    before = [(path, path.stat().st_ino) for path in tmp_path.rglob("*")]
    with pytest.raises(RuntimeError, match="no more"):
        record("line", tmp_path / "data", "random", alternate(fails_in=12), flocks=20)
    assert [(path, path.stat().st_ino) for path in tmp_path.rglob("*")] == before


def test_an_empty_folder_is_filled_and_stays_the_same_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mount point or the current folder cannot be replaced; of a link, the folder is filled."""
    (tmp_path / "data").mkdir()
    (tmp_path / "link").symlink_to("data")
    inode = (tmp_path / "data").stat().st_ino
    monkeypatch.chdir(tmp_path / "link")
    for output in (Path(), tmp_path / "link"):
        record("line", output, "random", flocks=1)
        assert (tmp_path / "data").stat().st_ino == inode
        assert len({path.unlink() or path.suffix for path in (tmp_path / "data").iterdir()}) == 2
    assert (tmp_path / "link").is_symlink()


@pytest.mark.parametrize("task", ["line", "per-agent-visible"])
def test_metadata_describes_every_file_and_column(task: str, tmp_path: Path) -> None:
    record(task, tmp_path, "random", flocks=1)
    document = json.loads((tmp_path / "croissant.json").read_text("utf-8"))
    files = {entry["contentUrl"]: entry for entry in document["distribution"]}
    assert {path.name for path in tmp_path.iterdir()} == {*files, "croissant.json"}
    for record_set in document["recordSet"]:
        path = tmp_path / f"{record_set['name']}.parquet"
        entry, rows = files[path.name], pl.read_parquet(path)
        assert entry["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
        assert entry["contentSize"] == f"{path.stat().st_size} B"
        assert [field["name"] for field in record_set["field"]] == rows.columns
        types = {field["name"]: field["dataType"] for field in record_set["field"]}
        assert types.get("action", "cr:Float32") == types.get("observation", "cr:Float32") == "cr:Float32"
        key = [column for column in rows.columns if column in KEYS]
        assert [each["@id"] for each in record_set["key"]] == [f"{path.stem}/{column}" for column in key]
        assert rows.select(key).n_unique() == len(rows)


def test_the_citation_is_that_of_the_project(tmp_path: Path) -> None:
    record("line", tmp_path, "random", flocks=1)
    document = json.loads((tmp_path / "croissant.json").read_text("utf-8"))
    cited = (ROOT / "CITATION.cff").read_text("utf-8")
    for pattern in (r'^title: "(.*)"$', r"^version: (.*)$", r"^  - name: (.*)$"):
        assert re.search(pattern, cited, re.MULTILINE)[1] in document["citeAs"]
    assert document["license"].endswith(f"/{re.search(r'^license: (.*)$', cited, re.MULTILINE)[1]}")
    assert document["version"] == __version__


def test_errors(tmp_path: Path) -> None:
    Path(tmp_path, "mine.txt").touch()
    data = tmp_path / "data"
    with pytest.raises(ArgumentError, match="seeds outside of the held-out ones"):
        record_episodes([LoadedPolicy.of("random")], task_of("line"), HELD_OUT[:1], data)
    with pytest.raises(ArgumentError, match="output: expected a new or empty folder"):
        record("line", tmp_path, "random")
    Path(tmp_path, "lost").symlink_to("nowhere")
    with pytest.raises(ArgumentError, match="output: expected a new or empty folder"):
        record("line", tmp_path / "lost", "random")
    with pytest.raises(ArgumentError, match="different names of policies"):
        record("line", data, "fixed:0.5", "fixed:0.5")
    with pytest.raises(ArgumentError, match="stubborn-leaders: per_agent: expected False"):
        record("shared", data, "stubborn-leaders")
    with pytest.raises(ArgumentError, match="a task with one range per flock or line, got per-agent-local"):
        minari_ids(task_of("per-agent-local"), ["random"])


def test_the_command_plays_the_rule_of_the_task(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rule = Shortcut(policy="fixed:0.3", says="a fixed range", score=0.0)
    task = dataclasses.replace(task_of("line"), shortcuts=(rule,))
    monkeypatch.setattr("flockesc_env.cli.episodes.task_of", {"line": task}.__getitem__)
    program = Application("flockesc benchmark", "", {"episodes": run}).main
    flags = ("--policies", "random", "rule", "--flocks", 3, "--output", tmp_path / "data")
    ran = Ran(capsys, "episodes", "line", *flags, run=program)
    assert ran.code == 0, ran.err
    ends = pl.read_parquet(tmp_path / "data" / "episodes.parquet")
    assert ends["seed"].unique(maintain_order=True).to_list() == list(TRAINING[:3])
    means = [(name, ends.filter(policy=name)["objective"].mean()) for name in ("random", "fixed-0-3")]
    shown = [line.split()[:2] for line in ran.out.splitlines()[1:]]
    assert shown == [[name, f"{mean:.3f}"] for name, mean in means]
