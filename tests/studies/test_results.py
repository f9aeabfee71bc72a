"""Results of studies: known aggregates, intervals that cover, pages that say what files say."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from committed_pages import check_results, skip_bootstraps, without_intervals
from scipy.stats import t, trim_mean, ttest_1samp, ttest_ind
from study_folders import write_study

from flockesc_env.common import stats
from flockesc_env.common.errors import RecordError
from flockesc_env.common.stats import Estimate
from studies.learned.aggregate import aggregate, difference, intervals, means, profile
from studies.learned.coverage import SEEDS, VARIATIONS, Variation, coverage, pigeonhole, two_way
from studies.learned.held_out import rules_of
from studies.learned.kinds import Kind, best_by_kind, kind_of, tuning_objectives
from studies.learned.page import DETAILS, LEARNED, details_page, markdown_page, readme_table
from studies.learned.questions import QUESTIONS
from studies.learned.results import BEST_FIXED, ORACLE, Study, load_studies, load_study
from studies.learned.summary import hidden, losses_first, outcomes, summarize
from studies.learned.tables import ablation_table, is_tied, versions
from training.presets import presets
from training.seeds import HELD_OUT

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "learned"
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


def test_intervals_of_one_training_seed_cover_the_flocks() -> None:
    assert 0.93 <= coverage(two_way, Variation(seeds=0), 1, 2_000) <= 0.97


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


@pytest.mark.parametrize(("num_seeds", "most"), [(3, 0.80), (5, 0.88), (10, 0.93)])
def test_the_bootstrap_over_few_training_seeds_covers_too_little(num_seeds: int, most: float) -> None:
    assert coverage(pigeonhole, VARIATIONS["training seeds dominate"], num_seeds, 1_000) < most


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
        ("episodes", lambda t: pl.concat([t, t[-1:]]), "search, training seed 2"),
        ("episodes", lambda t: t.filter(pl.col("policy") != BEST_FIXED), "policy"),
        ("episodes", lambda t: t.filter(pl.col("policy") != "ppo"), "every learner"),
        ("episodes", lambda t: t.with_columns(objective=pl.lit(float("nan"))), "objective"),
        ("episodes", lambda t: t.filter(pl.col("seed") != HELD_OUT[3]), "40 flocks"),
        ("episodes", lambda t: t.drop("seed"), "columns"),
        ("runs", lambda t: t.filter(pl.col("learner") == "ppo"), "none for search"),
        ("curves", lambda t: t.filter(pl.col("learner") == "ppo"), "none for search"),
        ("ablation", lambda t: t[:-1], "predator"),
        ("transfer", lambda t: t[:-1], "best fixed range there"),
    ],
)
def test_results_that_are_not_whole_are_refused(results: Path, file: str, change: object, named: str) -> None:
    edit(results / "per-agent-visible" / f"{file}.parquet", change)
    with pytest.raises(RecordError, match=named) as caught:
        load_studies(results)
    assert f"{file}.parquet" in caught.value.field


def test_folders_that_hold_something_else_are_refused(results: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=r"study\.json"):
        load_studies(tmp_path / "nothing")
    folder = results / "line"
    (folder / "grid.parquet").unlink()
    with pytest.raises(RecordError, match="grid"):
        load_study(folder)
    (folder / "study.json").write_text("{")
    with pytest.raises(RecordError, match=r"study\.json"):
        load_study(folder)
    whole = json.loads((results / "per-agent-visible" / "study.json").read_text())
    (results / "per-agent-visible" / "study.json").write_text(json.dumps({**whole, "explained": "nobody"}))
    with pytest.raises(RecordError, match="explained"):
        load_study(results / "per-agent-visible")
    moved = (results / "per-agent-visible").rename(results / "shared")
    with pytest.raises(RecordError, match="setting"):
        load_study(moved)
    (moved / "study.json").write_text(json.dumps({"learners": {}, "surplus": 1}))
    with pytest.raises(RecordError, match="surplus"):
        load_study(moved)


def rows_of(page: str, first: str) -> list[list[str]]:
    lines = re.findall(rf"^\| {re.escape(first)} \|.*$", page, re.MULTILINE)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_the_page_says_what_the_files_say(results: Path, tmp_path: Path) -> None:
    page = tmp_path / "docs" / "results.md"
    LEARNED.write(results, page)
    short, text = page.read_text(), page.with_name(DETAILS).read_text()
    visible, line = summarize(load_studies(results))  # in the order of the questions
    assert text.index("## per-agent-visible") < text.index("## line")
    for summary in (visible, line):
        for name, figures in summary.policies.items():
            cells = next(row for row in rows_of(text, name) if summary.show(figures.objective) in row)
            assert summary.iqm(name) in cells
            assert summary.kind(name) in cells
            assert summary.difference(name) in cells
            assert summary.seeds(name) in cells
        assert f"`python -m studies learned {summary.study.setting}`" in text
        assert f"**{summary.question}**" in text
    assert "+10.00 to +12.00" in text
    assert "would have been 8.5 m, with 2 m" in text
    assert "- `ppo`: a remark\n" in text
    (row,) = [row for row in rows_of(text, "ppo") if "individual_distance_change" in row]
    assert row[1] == "ppo"
    assert "seeds 2,000,000 to 2,999,999" in short
    assert [row[-1] for row in rows_of(text, "ppo")] == ["50,000 (25%)", "2.5"]
    (row,) = rows_of(short, "[per-agent-visible](results-details.md#per-agent-visible)")
    found = visible.policies["search"]
    gain = visible.show(found.difference, "+")
    assert row[4] == f"{visible.show(found.objective)} m<br>{gain} m<br>`search`, 3 seeds"
    assert row[3] == "-"
    pictures = re.findall(r"\]\((.*\.png)\)", short + text)
    assert len(pictures) == 4
    for picture in pictures:
        assert (page.parent / picture).read_bytes().startswith(b"\x89PNG")
    assert short == markdown_page([visible, line], results, page)
    assert text == details_page([visible, line], results, page.with_name(DETAILS))


def test_compact_tables(results: Path) -> None:
    visible, line = summaries = summarize(load_studies(results))
    assert is_tied(visible)
    assert not is_tied(line)
    hidden_groups = ablation_table(summaries)
    assert hidden_groups is not None
    assert hidden_groups.columns == ["predator", "time"]
    assert hidden_groups.rows == [("per-agent-visible `search`", ["-9.0", "-1.0"])]
    assert ablation_table([line]) is None
    assert versions(summaries) == {"1 core; numpy 2.0": ["per-agent-visible", "line"]}


def test_the_page_leaves_out_what_was_not_studied(results: Path, tmp_path: Path) -> None:
    (line,) = [summary for summary in summarize(load_studies(results)) if summary.study.is_line]
    text = details_page([line], results, tmp_path / "details.md")
    for heading in ("Credit assignment", "What the policies look at", "Transfer"):
        assert heading not in text


def test_the_table_of_the_readme_has_a_row_per_setting(results: Path) -> None:
    table = readme_table(summarize(load_studies(results))).splitlines()
    assert len(table) == 4
    cells = [cell.strip() for cell in table[2].strip("|").split("|")]
    fixed = (75 + drawn(FLOCKS)).mean()
    expected = [f"{fixed + gain:.2f}" for gain in (0, 13)] + ["-"]
    expected += [f"{fixed + gain:.2f}" for gain in (22 + 2 / 3, 11)]
    assert cells == ["per-agent-visible", *expected, "+9.67"]
    assert {line.count("|") for line in table} == {8}


def test_the_best_policy_of_a_kind_is_chosen_on_tuning_flocks(tmp_path: Path) -> None:
    fixed = 75 + drawn(FLOCKS)
    write_study(
        tmp_path,
        "shared",
        {BEST_FIXED: fixed, "head-away": fixed + 9, "turn-away": fixed + 5, "mine": fixed + 20},
        {
            "search": fixed[None] + 7,
            "ppo": fixed[None] + 6,
            "rule": fixed[None] + 1,
            "schedule": fixed[None] - 1,
        },
        about={"ppo": {"kind": "ppo"}, "rule": {"arguments": {"rule": "turn-away"}}},
        rules={"head-away": fixed - 1, "turn-away": fixed},  # on tuning flocks, turn-away is better
    )
    (summary,) = summarize(load_studies(tmp_path))
    assert summary.best == {
        Kind.RULE: "turn-away",
        Kind.SEARCHED: "rule",
        Kind.NETWORK: "search",
        Kind.REINFORCEMENT: "ppo",
    }
    assert kind_of(summary.study, "mine") is None
    assert summary.over_rule[Kind.SEARCHED].mean == pytest.approx(-4)
    assert summary.over_rule[Kind.NETWORK].mean == pytest.approx(2)
    assert summary.learned == Kind.NETWORK
    assert outcomes([summary])["better than"] == ["shared"]


def test_settings_in_which_learning_loses_come_first(tmp_path: Path) -> None:
    fixed = 75 + drawn(FLOCKS)
    for setting, gain in (("shared", 3.0), ("per-agent-local", -2.0), ("line", 0.0)):
        rules = {} if setting == "line" else {"turn-away": fixed}
        write_study(
            tmp_path, setting, {BEST_FIXED: fixed, **rules}, {"search": fixed[None] + gain}, rules=rules
        )
    summaries = summarize(load_studies(tmp_path))
    ordered = [summary.study.setting for summary in losses_first(summaries)]
    assert ordered == ["per-agent-local", "shared", "line"]
    assert outcomes(summaries)["worse than"] == ["per-agent-local"]


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


def test_the_committed_page_and_table_are_those_of_the_committed_results(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without intervals, which tests/slow/test_committed_pages.py compares."""
    skip_bootstraps(monkeypatch)
    summaries = check_results(without_intervals)
    assert {summary.study.setting for summary in summaries} <= set(QUESTIONS)
    page = ROOT / "docs" / "results.md"
    for text in (page.read_text(), page.with_name(DETAILS).read_text()):
        for picture in re.findall(r"\]\((.*?\.png)\)", text):
            assert (page.parent / picture).is_file()


def test_figures_of_flocks_agree_with_those_of_single_runs() -> None:
    values = drawn(1, FLOCKS)
    (found,) = means(values[None])
    plain = stats.mean(values[0])
    assert (found.low, found.high) == pytest.approx((plain.low, plain.high), abs=0.03)
