"""Own policies in the tables of the settings: what is added, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from study_folders import write_study

from flockesc_env import ArgumentError, FlockScenario, PolicySpec, rollout
from flockesc_env.policies import StubbornLeaders
from flockesc_env.policies.registry import NamedPolicy
from studies.learned.page import DETAILS
from studies.learned.results import BEST_FIXED, load_study
from studies.learned.submit import submit
from training.seeds import HELD_OUT

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
