"""A setting that gets the learners and rules that its results lack."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from tiny_studies import TINY, Spy, write_preset

from flockesc_env import built_in, rollout
from studies.learned.extension import extend_study
from studies.learned.results import Study, load_study
from studies.learned.study import StudyArgs, study
from training.seeds import TUNING


@pytest.fixture
def spy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Spy:
    write_preset(tmp_path, monkeypatch)
    return Spy(monkeypatch)


def arguments(folder: Path, **changes: Any) -> StudyArgs:
    few = {"held_out_flocks": 6, "tuning_flocks": 6, "backend": "serial"}
    return StudyArgs(
        **{"setting": "tiny", "output": folder / "results", "runs": folder / "runs", **few, **changes}
    )


def tables(found: Study) -> dict[str, pl.DataFrame]:
    names = ("episodes", "rules", "curves", "runs", "ablation")
    read = {name: getattr(found, name) for name in names}
    times = ("seconds", "minutes", "samples_per_second", "environment_share")
    return {name: table.drop(times, strict=False) for name, table in read.items()}


def test_an_extended_study_is_the_whole_study(spy: Spy, tmp_path: Path) -> None:
    whole = load_study(study(arguments(tmp_path / "whole")))
    part = arguments(tmp_path / "part", learners=("search",))
    folder = study(part)
    episodes = pl.read_parquet(folder / "episodes.parquet")
    episodes.filter(pl.col("policy") != "stubborn-leaders").write_parquet(folder / "episodes.parquet")
    (folder / "rules.parquet").unlink()
    spy.forget()
    assert extend_study(arguments(tmp_path / "part", runs=tmp_path / "other runs")) == folder
    assert [args.run.name for args in spy.trained] == ["schedule-0"]
    extended = load_study(folder)
    for name, table in tables(whole).items():
        assert table.equals(tables(extended)[name]), name
    about = [
        json.loads((path / "study.json").read_text()) for path in (folder, tmp_path / "whole/results/tiny")
    ]
    assert about[0] == about[1]
    assert (folder / "policies" / "schedule-0.npz").is_file()
    spy.forget()
    extend_study(arguments(tmp_path / "part"))
    assert not spy.trained
    assert load_study(folder).episodes.equals(whole.episodes)


def test_rules_run_on_the_tuning_flocks_of_learning_curves(spy: Spy, tmp_path: Path) -> None:
    found = load_study(study(arguments(tmp_path, learners=("schedule",))))
    assert found.rules is not None
    assert found.rules["rule"].unique().to_list() == ["stubborn-leaders"]
    assert found.rules["seed"].to_list() == list(TUNING[:200])
    told = rollout(TINY, built_in("stubborn-leaders"), TUNING[:200])
    assert found.rules["objective"].to_numpy() == pytest.approx(told.min_mean_distance)
