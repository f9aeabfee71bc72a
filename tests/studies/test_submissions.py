"""Own policies in the tables of the settings: what is added, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from study_folders import write_study

from flockesc_env import ArgumentError, FlockScenario, rollout
from flockesc_env.policies import FixedRange, StubbornLeaders
from flockesc_env.policies.registry import NamedPolicy
from studies.learned.page import DETAILS
from studies.learned.results import BEST_FIXED, load_study
from studies.learned.submit import check_fits, submit
from training.config import Setting
from training.seeds import HELD_OUT

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
        f"\n| my rule (v2) | - | - | {told.min_min_distance.mean():.2f} [" in page.with_name(DETAILS).read_text()
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


@pytest.mark.parametrize(
    ("setting", "policy", "name", "field"),
    [
        ("huge", "stubborn-leaders-local", "mine", "setting"),
        ("tiny", "stubborn-leaders-local", "search", "name"),
        ("tiny", "stubborn-leaders-local", "a|b", "name"),
        ("tiny", "stubborn-leaders-local", "", "name"),
        ("tiny", "fixed:10", "mine", "per_agent"),
        ("tiny", "stubborn-leaders", "mine", "predator_sensing_range"),
        ("tiny", "stubborn-followers", "mine", "policies"),
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


def test_other_flocks_than_the_held_out_ones_are_refused(tiny: Path, tmp_path: Path) -> None:
    path = tiny / "tiny" / "episodes.parquet"
    pl.read_parquet(path).with_columns(pl.col("seed") + 1).write_parquet(path)
    with pytest.raises(ArgumentError, match="flocks 2000000 to 2000005"):
        submit("tiny", "stubborn-leaders-local", "mine", tiny, tmp_path / "results.md")


LOCAL = Setting(per_agent=False, predator_visible=False)
VISIBLE = Setting(per_agent=False)
LINE = Setting(scenario="paper-line")
RHO = FixedRange(0.1)


@pytest.mark.parametrize(
    ("entry", "setting"),
    [
        (NamedPolicy("", RHO), LOCAL),
        (NamedPolicy("", RHO, options={"predator_sensing_range": 5.0}), LOCAL),
        (
            NamedPolicy("", RHO, options={"max_range": 1.0, "steps_per_action": 7, "reward": "terminal"}),
            LOCAL,
        ),
        (NamedPolicy("", RHO, options={"predator_sensing_range": None}), VISIBLE),
        (NamedPolicy("", RHO, options={"predator_sensing_range": 1000.0}), VISIBLE),
        (NamedPolicy("", RHO, options={"max_range": 0.5}), LINE),
    ],
)
def test_policies_that_see_no_more_than_the_setting_shows_fit(entry: NamedPolicy, setting: Setting) -> None:
    check_fits(entry, setting)


@pytest.mark.parametrize(
    ("entry", "setting", "field"),
    [
        (NamedPolicy("", RHO, options={"predator_sensing_range": None}), LOCAL, "predator_sensing_range"),
        (NamedPolicy("", RHO, options={"predator_sensing_range": 30.5}), LOCAL, "predator_sensing_range"),
        (NamedPolicy("", RHO, per_agent=True), LOCAL, "per_agent"),
        (NamedPolicy("", RHO, per_agent=True), LINE, "per_agent"),
        (NamedPolicy("", RHO, scenario=SMALL), LINE, "scenario"),
        (NamedPolicy("", RHO, options={"predator_sensing_range": None}), LINE, "options"),
        (NamedPolicy("", RHO, options={"max_rage": 1.0}), LOCAL, "options"),
    ],
)
def test_policies_for_other_problems_do_not(entry: NamedPolicy, setting: Setting, field: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        check_fits(entry, setting)
    assert caught.value.field == field
