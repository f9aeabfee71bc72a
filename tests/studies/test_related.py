"""Related results: the best k by speed on made-up objectives, the bandit's study, and the page."""

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
from studies.related.attack_speed import NEIGHBORS, SPEEDS, attack_results
from studies.related.page import BANDIT_FILE, RelatedResults
from studies.related.page import markdown_page as related_page
from studies.related.within_episode import BANDIT, IN_TURNS, BanditNumbers, candidates

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results"


def made_up(best: dict[float, int], seed: int, flocks: int) -> dict[str, Any]:
    """Return objectives whose largest mean is at a given k, by speed."""
    rng = np.random.default_rng(seed)
    found = {}
    for speed, k in best.items():
        distance = np.abs(np.log(np.array(NEIGHBORS) / k))[:, None]
        values = 50 - distance + 0.01 * rng.normal(size=(len(NEIGHBORS), flocks))
        found[str(speed)] = {"min_mean_distance": values, "min_min_distance": -values}
    return found


def test_the_best_k_is_chosen_on_tuning_flocks_and_measured_on_held_out_ones() -> None:
    tuning = made_up({0.5: 100, 1.0: 30, 2.0: 10, 4.0: 3}, 0, 20)
    held_out = made_up({0.5: 100, 1.0: 30, 2.0: 10, 4.0: 2}, 1, 40)
    measured = {f"tuning {speed}": columns for speed, columns in tuning.items()}
    measured |= {f"held out {speed}": columns for speed, columns in held_out.items()}
    for speed, columns in tuning.items():
        measured[f"longer {speed}"] = {name: values[:, :4] - 0.25 for name, values in columns.items()}
    results = attack_results(measured)
    assert [row.neighbors.mean for row in results.best["J_mean"]] == [100, 30, 10, 3]
    assert (results.tuning_flocks, results.num_flocks) == (20, 40)
    fastest = results.best["J_mean"][-1]
    values = held_out["4.0"]["min_mean_distance"]
    at = {k: values[NEIGHBORS.index(k)].mean() for k in (1, 3, 100)}
    assert fastest.value.mean == pytest.approx(at[3])
    assert fastest.gain_over_most.mean == pytest.approx(at[3] - at[100])
    assert fastest.curve[NEIGHBORS.index(3)].mean == pytest.approx(at[3] - at[1])
    assert results.falls["J_mean"] == 1
    assert results.longer["J_mean"] == pytest.approx((0.25,) * len(SPEEDS))


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
    assert related.read_text() == related_page(results, COMMITTED / "related", related)


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
