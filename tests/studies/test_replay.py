"""Committed policy files reproduce, and a replay finds and replaces objectives that differ."""

from __future__ import annotations

import shutil
from itertools import groupby
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from cli_runs import Ran
from tiny_studies import write_preset
from training.presets import presets

from flockesc_env.cli.exits import Exit
from flockesc_env.jobs import Cache, find_backend
from studies.__main__ import STUDIES
from studies.findings.replay import policy_files, replay
from studies.findings.results import BEST_FIXED, load_studies, load_study
from studies.findings.study import StudyArgs, study
from studies.measurements import Runner

RESULTS = Path("results/findings")
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
    """Results of a tiny study."""
    path = tmp_path_factory.mktemp("replay")
    with pytest.MonkeyPatch.context() as patch:
        write_preset(path, patch)
        study(StudyArgs("tiny", path / "results", path / "runs", (), 12, 20, "serial"))
        yield path / "results"


@pytest.fixture
def results(studied: Path, tmp_path: Path) -> Path:
    """A copy of the results."""
    return Path(shutil.copytree(studied, tmp_path / "results"))


def run(results: Path, capsys: pytest.CaptureFixture[str], *words: str) -> Ran:
    words = ("findings-replay", "tiny", "--results", str(results), "--backend", "serial", *words)
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
    document = (folder / "study.json").read_text("utf-8")
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
    assert (folder / "study.json").read_text("utf-8") == document
    for name, table in before.items():
        assert pl.read_parquet(folder / name).equals(table), name
