"""Related results: the bandit's study, and the page."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from study_folders import check_race, skip_bootstraps, without_intervals

from flockesc_env import FlockScenario
from flockesc_env.jobs import Cache, find_backend
from studies.learned.results import BEST_FIXED, load_study
from studies.measurements import Runner
from studies.related import within_episode
from studies.related.page import BANDIT_FILE, RelatedResults
from studies.related.page import markdown_page as related_page
from studies.related.within_episode import BANDIT, IN_TURNS, BanditNumbers, candidates

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results"


def test_the_bandit_is_tuned_on_tuning_flocks_and_paired_on_held_out_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = FlockScenario(num_agents=5, num_steps=20)
    monkeypatch.setattr(within_episode, "FlockScenario", lambda: small)
    monkeypatch.setattr(within_episode, "FINAL_FLOCKS", 6)
    monkeypatch.setattr(within_episode, "FIRST_FLOCKS", 3)
    few = candidates("J_mean")[:7]
    monkeypatch.setattr(within_episode, "candidates", lambda _: few)
    played: list[tuple[BanditNumbers, range]] = []
    play = within_episode.play

    def noted(numbers: BanditNumbers, flocks: range) -> Any:
        played.append((numbers, flocks))
        return play(numbers, flocks)

    monkeypatch.setattr(within_episode, "play", noted)
    study = load_study(COMMITTED / "learned" / "shared")
    results, table = within_episode.within_episode(
        "J_mean", study, Runner(Cache(tmp_path / "cache"), find_backend("serial"))
    )
    assert [flocks for _, flocks in played[:7]] == [range(1_000_000, 1_000_003)] * 7
    assert {flocks for _, flocks in played[7:-12]} == {range(1_000_000, 1_000_006)}
    held_out = range(2_000_000, 2_001_000)
    bandits = [dataclasses.replace(results.numbers, ranges=order.ranges) for order in results.orders]
    turns = [dataclasses.replace(bandit, exploration=IN_TURNS) for bandit in bandits]
    assert played[-12:] == [(numbers, held_out) for numbers in bandits + turns]
    assert table.columns == study.episodes.columns
    assert set(table["policy"]) == {BANDIT}
    assert table["seed"].to_list() == study.flocks
    values = table["objective"].to_numpy()
    assert results.difference.mean == pytest.approx((values - study.values(BEST_FIXED)[0]).mean())
    assert results.orders[0].bandit == results.difference
    for name in ("turns", "bandit", "over_turns"):
        means = [getattr(order, name).mean for order in results.orders]
        assert getattr(results.mean_order, name).mean == pytest.approx(np.mean(means))


def test_the_committed_page_follows_from_the_committed_results() -> None:
    related = ROOT / "docs" / "related.md"
    results = RelatedResults.load(COMMITTED / "related")
    assert related.read_text("utf-8") == related_page(results, COMMITTED / "related", related)


def test_the_committed_page_of_the_arms_race_follows_from_its_results(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Tables without intervals; tests/slow/test_committed_pages.py compares whole pages."""
    skip_bootstraps(monkeypatch)

    def tables(text: str) -> str:
        return without_intervals("\n".join(line for line in text.splitlines() if line.startswith("|")))

    check_race(tables)


def test_the_committed_bandit_reproduces_its_rows() -> None:
    results = RelatedResults.load(COMMITTED / "related")
    numbers = results.within["J_mean"].numbers
    found = within_episode.play(numbers, range(2_000_000, 2_000_002))["min_mean_distance"]
    stored = pl.read_parquet(COMMITTED / "related" / BANDIT_FILE).filter(setting="shared")
    np.testing.assert_array_equal(found, stored.sort("seed")["objective"].to_numpy()[:2])
