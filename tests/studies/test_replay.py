"""Committed policy files reproduce, and own policies enter the tables: what is added, and what is refused."""

from __future__ import annotations

import shutil
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import polars as pl
import pytest
from cli_runs import Ran
from study_folders import write_study
from tiny_studies import write_preset

from flockesc_env import ArgumentError, FlockScenario, PolicySpec, rollout
from flockesc_env.benchmark.seeds import HELD_OUT
from flockesc_env.cli.exits import Exit
from flockesc_env.jobs import Cache, find_backend
from flockesc_env.policies import StubbornLeaders
from flockesc_env.policies.registry import NamedPolicy
from studies.__main__ import STUDIES
from studies.learned.page import DETAILS
from studies.learned.replay import policy_files, replay
from studies.learned.results import BEST_FIXED, load_studies, load_study
from studies.learned.study import StudyArgs, study
from studies.learned.submit import submit
from studies.measurements import Runner
from training.presets import presets

RESULTS = Path("results/learned")
SETTINGS = list(presets())
FLOCKS = 5


@pytest.mark.parametrize("setting", SETTINGS)
def test_a_file_of_every_learner_reproduces_its_episodes(setting: str, tmp_path: Path) -> None:
    """Bit for bit, on a few flocks; tests/slow replays all files on all flocks."""
    found = load_study(RESULTS / setting)
    by_learner = groupby(policy_files(found), key=lambda file: file.stem.rpartition("-")[0])
    files = [next(files) for _, files in by_learner]
    again = replay(found, Runner(Cache(tmp_path), find_backend("serial")), flocks=FLOCKS, files=files)
    title = f"{setting}: {len(files)} of {len(files)} files reproduce on {FLOCKS} flocks"
    assert again.lines() == [f"{title}; so do {again.rules} rules and the fixed ranges"]


def test_every_file_and_setting_is_replayed() -> None:
    assert sorted(found.setting for found in load_studies(RESULTS)) == sorted(SETTINGS)
    for setting in SETTINGS:
        files = policy_files(load_study(RESULTS / setting))
        assert sorted(files) == sorted((RESULTS / setting / "policies").iterdir())


@pytest.fixture(scope="module")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Results of a tiny study, with a policy that somebody else submitted."""
    path = tmp_path_factory.mktemp("replay")
    with pytest.MonkeyPatch.context() as patch:
        write_preset(path, patch)
        study(StudyArgs("tiny", path / "results", path / "runs", (), 12, 20, "serial"))
        episodes = path / "results" / "tiny" / "episodes.parquet"
        mine = pl.read_parquet(episodes).filter(policy="stubborn-leaders").with_columns(policy=pl.lit("mine"))
        pl.concat([pl.read_parquet(episodes), mine]).write_parquet(episodes)
        yield path / "results"


@pytest.fixture
def results(studied: Path, tmp_path: Path) -> Path:
    """A copy of the results."""
    return Path(shutil.copytree(studied, tmp_path / "results"))


def run(results: Path, capsys: pytest.CaptureFixture[str], *words: str) -> Ran:
    words = ("learned-replay", "tiny", "--results", str(results), "--backend", "serial", *words)
    return Ran(capsys, *words, run=STUDIES.main)


def bump(path: Path, rows: pl.Expr) -> None:
    """Change values in the last bits."""
    changed = pl.when(rows).then(pl.col("objective") * (1 + 1e-15)).otherwise("objective")
    pl.read_parquet(path).with_columns(objective=changed).write_parquet(path)


def test_a_study_reproduces(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (results / "tiny" / "episodes.parquet").read_bytes()
    ran = run(results, capsys)
    expected = "tiny: 3 of 3 files reproduce on 12 flocks; so do 1 rules and the fixed ranges\n"
    assert (ran.code, ran.out) == (Exit.DONE, expected)
    assert (results / "tiny" / "episodes.parquet").read_bytes() == before


def test_differences_in_the_last_bit_are_found_and_replaced(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = results / "tiny"
    before = {name: pl.read_parquet(folder / name) for name in ("episodes.parquet", "grid.parquet")}
    document = (folder / "study.json").read_text()
    first = pl.col("seed") < 2_000_002
    bump(folder / "episodes.parquet", (pl.col("policy") == "search") & (pl.col("training_seed") == 1) & first)
    bump(folder / "episodes.parquet", pl.col("policy").is_in([BEST_FIXED, "stubborn-leaders"]))
    before["grid.parquet"].with_columns(pl.col("mean") + 1e-12).write_parquet(folder / "grid.parquet")
    best = load_study(folder).best_fixed_range
    (folder / "study.json").write_text(document.replace(f'range": {best}', 'range": 150.0'))

    ran = run(results, capsys)
    assert ran.code == Exit.FAILED
    title, choice, fixed, rule, file, grid = ran.out.splitlines()
    assert title == "tiny: 2 of 3 files reproduce on 12 flocks"
    assert choice == f"  choice of the best fixed range: {best:g} instead of 150"
    assert fixed.startswith(
        "  best fixed range: 12 of 12 flocks differ (2000000, 2000001, 2000002, ..), by up to "
    )
    assert rule.startswith("  stubborn-leaders: 12 of 12 flocks differ")
    assert file.startswith("  search-1: 2 of 12 flocks differ (2000000, 2000001), by up to ")
    assert grid == "  grid.parquet: other means or intervals of fixed ranges"

    assert run(results, capsys, "--write").code == Exit.DONE
    assert run(results, capsys).code == Exit.DONE
    assert (folder / "study.json").read_text() == document
    for name, table in before.items():
        assert pl.read_parquet(folder / name).equals(table), name
    assert "mine" in load_study(folder).policies


HERE = __name__
"""The module of the policies below."""

SMALL = FlockScenario(num_agents=12, num_steps=24, initial_side=20.0)


@pytest.fixture
def tiny(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Results of a tiny setting: one range per agent, the predator seen nearby."""
    presets = tmp_path / "presets"
    presets.mkdir()
    (tmp_path / "small.toml").write_text(SMALL.to_toml())
    (presets / "tiny.toml").write_text(
        f'title = "tiny"\n[setting]\nscenario = "{tmp_path / "small.toml"}"\nper_agent = true\n'
        'predator_visible = false\nobjective = "minimum"\n[learners.search]\nkind = "search"\n'
    )
    monkeypatch.setattr("training.presets.PRESETS", presets)
    results = tmp_path / "results"
    fixed = 20 + np.random.default_rng(0).normal(size=6)
    write_study(
        results, "tiny", {BEST_FIXED: fixed}, {"search": fixed + np.ones((2, 1))}, objective="minimum"
    )
    return results


def test_a_submission_end_to_end(tiny: Path, tmp_path: Path) -> None:
    page = tmp_path / "docs" / "results.md"
    before = load_study(tiny / "tiny")
    sentence = submit("tiny", "stubborn-leaders-local", "my rule (v2)", tiny, page)
    study = load_study(tiny / "tiny")
    assert study.policies == [*before.policies, "my rule (v2)"]
    assert study.episodes[: len(before.episodes)].equals(before.episodes)
    told = rollout(SMALL, StubbornLeaders(), HELD_OUT[:6], per_agent=True)
    assert study.values("my rule (v2)") == pytest.approx(told.min_min_distance[None])
    assert study.episodes["training_seed"][-6:].null_count() == 6
    assert (
        f"\n| my rule (v2) | - | - | {told.min_min_distance.mean():.2f} ["
        in page.with_name(DETAILS).read_text()
    )
    assert f"my rule (v2) {told.min_min_distance.mean():.2f} [" in sentence
    with pytest.raises(ArgumentError, match="name"):
        submit("tiny", "stubborn-leaders-local", "my rule (v2)", tiny, page)
    written = (tiny / "tiny" / "episodes.parquet").read_bytes()
    for name in ("my rule (v2)", "my rule (v3)"):
        assert submit("tiny", "random", name, tiny, page, replace=True, dry_run=True) != sentence
    assert (tiny / "tiny" / "episodes.parquet").read_bytes() == written
    assert submit("tiny", "stubborn-leaders-local", "my rule (v2)", tiny, page, replace=True) == sentence
    assert load_study(tiny / "tiny").episodes.equals(study.episodes)


class Rule(StubbornLeaders):
    """Code that could hold a simulator, and that records the running minimum of its rows."""

    seen: ClassVar[list[np.ndarray]] = []

    def act(self, observations: np.ndarray, spec: PolicySpec) -> np.ndarray:
        self.seen.append(observations[:, spec.layout.index("running_minimum")])
        return super().act(observations, spec)


def with_escape_direction() -> NamedPolicy:
    return NamedPolicy("own", Rule(), True, {"extra_entries": ("escape_direction",)})


def of_the_mean() -> NamedPolicy:
    return NamedPolicy("own", Rule(), True, {"objective": "mean"})


@pytest.mark.parametrize(
    ("setting", "policy", "name", "field"),
    [
        ("huge", "stubborn-leaders-local", "mine", "setting"),
        ("tiny", "stubborn-leaders-local", "search", "name"),
        ("tiny", "fixed:10", "mine", "per_agent"),
        ("tiny", "stubborn-leaders", "mine", "predator_sensing_range"),
        ("tiny", "spread-out", "mine", "profile_ranges"),
        ("tiny", f"{HERE}:with_escape_direction", "mine", "extra_entries"),
        ("tiny", f"{HERE}:of_the_mean", "mine", "objective"),
    ],
)
def test_refused_submissions_change_nothing(
    tiny: Path, tmp_path: Path, setting: str, policy: str, name: str, field: str
) -> None:
    before = (tiny / "tiny" / "episodes.parquet").read_bytes()
    with pytest.raises(ArgumentError) as caught:
        submit(setting, policy, name, tiny, tmp_path / "results.md")
    assert caught.value.field == field
    assert (tiny / "tiny" / "episodes.parquet").read_bytes() == before
    assert not (tmp_path / "results.md").exists()
