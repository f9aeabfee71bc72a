"""Results of studies: known aggregates, intervals that cover, pages that say what files say."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from committed_pages import check_results, skip_bootstraps, without_intervals
from scipy.stats import bootstrap
from study_folders import write_study

from flockesc_env.common import stats
from flockesc_env.common.errors import RecordError
from flockesc_env.common.stats import Estimate
from studies.learned.aggregate import RESAMPLES, aggregate, iqm, means, profile
from studies.learned.page import DETAILS, details_page, markdown_page, readme_table, write_page
from studies.learned.questions import QUESTIONS
from studies.learned.results import BEST_FIXED, ORACLE, load_studies, load_study
from studies.learned.summary import hidden, summarize
from studies.learned.tables import ablation_table, is_tied, versions
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
    # Twelve episodes: -1 0 1 | 1 2 2 3 3 4... the middle six count.
    assert found.iqm.mean == pytest.approx(np.sort([1, 2, 3, 4, -1, 0, 1, 2, 6, 7, 8, 9])[3:9].mean())
    assert aggregate(baseline[None], baseline).improvement.mean == pytest.approx(0.5)
    assert aggregate(baseline[None], baseline).difference == Estimate(0.0, 0.0, 0.0)


@pytest.mark.parametrize("seeds", [1, 3])
def test_intervals_are_those_of_the_plain_bootstrap_over_seeds_and_flocks(seeds: int) -> None:
    # Imported here, because it takes seconds in every worker that collects this file.
    from rliable.library import score_distributions
    from rliable.metrics import aggregate_iqm

    values = drawn(seeds, 12)
    samples = [np.arange(size) for size in values.shape if size > 1]

    def plain(statistic: object) -> object:
        def one(*chosen: np.ndarray) -> float:
            rows = chosen[0] if seeds > 1 else [0]
            return statistic(values[np.ix_(rows, chosen[-1])])  # type: ignore[operator]

        options = {"n_resamples": RESAMPLES, "batch": 100, "method": "percentile", "vectorized": False}
        return bootstrap(samples, one, rng=np.random.default_rng(0), **options).confidence_interval

    (mean,) = means(values[None])
    assert (mean.low, mean.high) == pytest.approx(plain(np.mean))
    middle = iqm(values)
    assert middle.mean == pytest.approx(aggregate_iqm(values))
    assert (middle.low, middle.high) == pytest.approx(plain(aggregate_iqm))
    above = profile(values, np.array([0.3]))
    assert above.share == pytest.approx(score_distributions(values, [0.3]))
    assert (above.low[0], above.high[0]) == pytest.approx(plain(lambda part: np.mean(part > 0.3)))


def test_intervals_cover_the_truth_where_those_over_flocks_alone_do_not() -> None:
    rng = np.random.default_rng(0)
    both = flocks_alone = 0
    for _ in range(100):
        values = rng.normal(size=(10, 1)) + rng.normal(size=50) + rng.normal(size=(10, 50))
        (found,) = means(values[None])
        both += found.low < 0 < found.high
        (found,) = means(values.mean(axis=0)[None, None])
        flocks_alone += found.low < 0 < found.high
    assert both >= 88
    assert flocks_alone < 75


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
    write_page(results, page)
    short, text = page.read_text(), page.with_name(DETAILS).read_text()
    visible, line = summarize(load_studies(results))  # in the order of the questions
    assert text.index("## per-agent-visible") < text.index("## line")
    for summary in (visible, line):
        for name, figures in summary.policies.items():
            cells = next(row for row in rows_of(text, name) if summary.show(figures.objective) in row)
            assert summary.show(figures.iqm) in cells
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
    assert row[3] == f"{visible.difference('search')} m"
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
    assert cells[0] == "per-agent-visible"
    assert cells[2].endswith("(`search`)")
    assert cells[3].startswith("+22.67 [")
    assert cells[4:] == ["3", "3.0"]
    assert {line.count("|") for line in table} == {7}


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
