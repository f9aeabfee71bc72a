"""Results of studies: known aggregates, intervals that cover, pages that say what files say."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from scipy.stats import t, trim_mean, ttest_1samp, ttest_ind
from study_folders import check_results, skip_bootstraps, without_intervals, write_study
from training.presets import presets

from flockesc_env.common.errors import RecordError
from flockesc_env.common.stats import Estimate
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.tasks.statistics import aggregate, difference, intervals, means, profile
from studies.findings.coverage import SEEDS, VARIATIONS, coverage, two_way
from studies.findings.held_out import rules_of
from studies.findings.kinds import Kind, best_by_kind, kind_of, tuning_objectives
from studies.findings.page import DETAILS
from studies.findings.questions import QUESTIONS
from studies.findings.results import BEST_FIXED, ORACLE, Study, load_studies, load_study
from studies.findings.summary import hidden

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "findings"
FLOCKS = 40


def drawn(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A setting with all there can be, and the line with the least."""
    folder = tmp_path / "results"
    fixed = 75 + drawn(FLOCKS)
    own = {"ppo": {"kind": "ppo", "arguments": {"reward": "individual_distance_change"}, "note": "a remark"}}
    write_study(
        folder,
        "per-agent-visible",
        {BEST_FIXED: fixed, ORACLE: fixed + 4, "stubborn-leaders": fixed + 13},
        {"ppo": fixed + np.array([[10.0], [12.0]]), "search": fixed + np.array([[22.5], [22.0], [23.5]])},
        about=own,
        rules={"stubborn-leaders": fixed[:4]},
        explained="search",
        ablation=[("nothing", fixed), ("time", fixed - 1.0), ("predator", fixed - 9.0)],
        transfer=[
            (world, name, fixed + gain)
            for world, name, gain in [
                ("pursuit", "learned", 3.0),
                ("pursuit", "best fixed range there", 1.0),
            ]
        ],
    )
    line = 0.4 + drawn(FLOCKS) / 100
    write_study(folder, "line", {BEST_FIXED: line}, {"search": line[None] + 0.125}, is_line=True)
    return folder


def test_aggregates_of_known_episodes() -> None:
    baseline = np.array([0.0, 1.0, 2.0, 3.0])
    found = aggregate(baseline + np.array([[1.0], [-1.0], [6.0]]), baseline)
    assert found.objective.mean == pytest.approx(3.5)
    assert found.difference.mean == pytest.approx(2.0)
    assert (found.lowest, found.highest) == pytest.approx((-1.0, 6.0))
    assert found.improvement.mean == pytest.approx(2 / 3)
    runs = drawn(10, 4)
    assert aggregate(runs, baseline).iqm == pytest.approx(trim_mean(runs.mean(axis=1), 0.25))
    assert aggregate(baseline[None], baseline).improvement.mean == pytest.approx(0.5)
    assert aggregate(baseline[None], baseline).difference == Estimate(0.0, 0.0, 0.0)


def test_intervals_are_students_where_only_flocks_or_only_training_seeds_vary() -> None:
    flocks, seeds = drawn(12), drawn(5, seed=1)
    (one,) = means(flocks[None, None])
    assert (one.low, one.high) == pytest.approx(tuple(ttest_1samp(flocks, 0).confidence_interval()))
    (many,) = means(np.repeat(seeds[:, None], 12, axis=1)[None])
    assert (many.low, many.high) == pytest.approx(tuple(ttest_1samp(seeds, 0).confidence_interval()))
    (same,) = means(np.full((1, 3, 4), 2.0))
    assert same == Estimate(2.0, 2.0, 2.0)


def test_intervals_follow_from_the_mean_squares_of_the_two_way_analysis_of_variance() -> None:
    # Rows 1 2 6, 3 4 8: seeds' mean square 6, flocks' 20.333.., no rest. Total 26.33..; see Satterthwaite.
    (found,) = means(np.array([[[1.0, 2.0, 6.0], [3.0, 4.0, 8.0]]]))
    seeds, flocks = 6.0, 2 * np.var([2, 3, 7], ddof=1)
    freedom = (seeds + flocks) ** 2 / (seeds**2 / 1 + flocks**2 / 2)
    half = t.ppf(0.975, freedom) * np.sqrt((seeds + flocks) / 6)
    assert (found.mean, found.low, found.high) == pytest.approx((4.0, 4.0 - half, 4.0 + half))


def test_differences_of_two_learners_cover_both_training_seeds() -> None:
    flocks, mine, other = drawn(12), drawn(4, 1, seed=1), drawn(3, 1, seed=2)
    found = difference(flocks + mine, flocks + other)
    # Flocks cancel. What remains is Welch's interval of two samples of training seeds.
    welch = ttest_ind(mine[:, 0], other[:, 0], equal_var=False).confidence_interval()
    assert (found.low, found.high) == pytest.approx(tuple(welch))
    (paired,) = means((flocks + mine - drawn(12, seed=3))[None])
    one = difference(flocks + mine, drawn(12, seed=3)[None])
    assert (one.mean, one.low, one.high) == pytest.approx((paired.mean, paired.low, paired.high))


def test_shares_stay_within_0_and_1() -> None:
    # Imported here, because it takes seconds in every worker that collects this file.
    from rliable.library import score_distributions

    values = drawn(3, 12)
    above = profile(values, np.array([-3.0, 0.3, 2.0]))
    assert above.share == pytest.approx(score_distributions(values, [-3.0, 0.3, 2.0]))
    assert (above.low >= 0).all()
    assert (above.high <= 1).all()
    assert above.low[1] < above.share[1] < above.high[1]
    mostly = aggregate(np.where(np.arange(40) < 39, 1.0, -1.0)[None], np.zeros(40)).improvement
    assert mostly.mean == pytest.approx(39 / 40)
    assert mostly.high == 1.0


@pytest.mark.parametrize("num_seeds", SEEDS)
@pytest.mark.parametrize("variation", [name for name in VARIATIONS if "skewed" not in name])
def test_intervals_cover_the_true_mean(variation: str, num_seeds: int) -> None:
    covered = coverage(two_way, VARIATIONS[variation], num_seeds, 2_000)
    assert 0.93 <= covered <= 0.985


@pytest.mark.parametrize("strength", [0.0, 0.1, 1.0])
def test_intervals_of_differences_cover_the_true_difference(strength: float) -> None:
    rng = np.random.default_rng(0)
    shape = 2_000, 1, 50
    flocks = rng.normal(size=shape)

    def runs(num_seeds: int, response: float) -> np.ndarray:
        seeds = strength * rng.normal(size=(2_000, num_seeds, 1))
        return seeds + response * flocks + rng.normal(size=(2_000, num_seeds, 50))

    _, low, high = intervals(runs(5, 1.0), runs(3, 0.5))
    assert 0.93 <= ((low < 0) & (high > 0)).mean() <= 0.985


def test_studies_are_read_as_written(results: Path) -> None:
    line, study = load_studies(results)
    assert (line.setting, line.unit, study.unit) == ("line", "", " m")
    assert study.policies == [BEST_FIXED, ORACLE, "stubborn-leaders", "ppo", "search"]
    assert study.trained == ["ppo", "search"]
    assert study.best_learner == "search"
    fixed = 75 + drawn(FLOCKS)
    assert study.values(BEST_FIXED) == pytest.approx(fixed[None])
    assert study.values("ppo") == pytest.approx(fixed + np.array([[10.0], [12.0]]))
    assert study.flocks == list(HELD_OUT[:FLOCKS])
    assert line.ablation is None
    assert hidden(line) == []
    assert [(name, change.mean) for name, change in hidden(study)] == [
        ("predator", pytest.approx(-9.0)),
        ("time", pytest.approx(-1.0)),
    ]


def edit(path: Path, change: object) -> None:
    change(pl.read_parquet(path)).write_parquet(path)  # type: ignore[operator]


@pytest.mark.parametrize(
    ("file", "change", "named"),
    [
        ("episodes", lambda t: t[:-1], "search, training seed 2"),
        ("episodes", lambda t: t.filter(pl.col("policy") != BEST_FIXED), "policy"),
        ("episodes", lambda t: t.with_columns(objective=pl.lit(float("nan"))), "objective"),
        ("episodes", lambda t: t.filter(pl.col("seed") != HELD_OUT[3]), "40 flocks"),
        ("runs", lambda t: t.filter(pl.col("learner") == "ppo"), "none for search"),
        ("ablation", lambda t: t[:-1], "predator"),
        ("transfer", lambda t: t[:-1], "best fixed range there"),
    ],
)
def test_results_that_are_not_whole_are_refused(results: Path, file: str, change: object, named: str) -> None:
    edit(results / "per-agent-visible" / f"{file}.parquet", change)
    with pytest.raises(RecordError, match=named) as caught:
        load_studies(results)
    assert f"{file}.parquet" in caught.value.field


@pytest.mark.parametrize("study", load_studies(COMMITTED), ids=lambda study: study.setting)
def test_committed_rules_have_tuning_flocks_and_held_out_flocks(study: Study) -> None:
    names = set(rules_of(study.setting, presets()[study.setting].setting))
    tuned = set() if study.rules is None else set(study.rules["rule"])
    assert names == tuned
    assert {name for name in study.policies if kind_of(study, name) == Kind.RULE} == names
    assert set(best_by_kind(study).values()) <= set(tuning_objectives(study))


@pytest.mark.parametrize("study", load_studies(COMMITTED), ids=lambda study: study.setting)
def test_learners_of_presets_have_committed_results(study: Study) -> None:
    learners = presets()[study.setting].learners
    assert set(study.learners) == {name for name, learner in learners.items() if learner.seeds}


def test_the_headline_of_the_readme_is_that_of_committed_results() -> None:
    study, readme = load_study(COMMITTED / "per-agent-visible"), (ROOT / "README.md").read_text("utf-8")
    found, prose = aggregate(study.values("search"), study.values(BEST_FIXED)[0]), " ".join(readme.split())
    assert f"{found.difference:.1f}".replace(" [", " m [") in prose.split("```", 1)[0]
    assert f"{found.objective.mean:.1f} m against {study.values(BEST_FIXED).mean():.1f} m" in prose


def test_the_committed_page_and_table_are_those_of_the_committed_results(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without intervals, which tests/slow/test_committed_pages.py compares."""
    skip_bootstraps(monkeypatch)
    summaries = check_results(without_intervals)
    assert {summary.study.setting for summary in summaries} <= set(QUESTIONS)
    page = ROOT / "docs" / "findings.md"
    for text in (page.read_text("utf-8"), page.with_name(DETAILS).read_text("utf-8")):
        for picture in re.findall(r"\]\((.*?\.png)\)", text):
            assert (page.parent / picture).is_file()
