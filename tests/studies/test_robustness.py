"""The robustness study: the best fixed range in every preset, the rule of its findings, and its page."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli_runs import Ran

from flockesc_env import (
    PRESETS,
    ArgumentError,
    FlockScenario,
    sweep,
)
from flockesc_env.cli.exits import Exit
from flockesc_env.common.stats import Estimate
from flockesc_env.scenario.presets import LITERATURE
from studies.__main__ import STUDIES
from studies.robustness.findings import Finding, Outcome, outcome
from studies.robustness.page import RobustnessResults, answers, markdown_page
from studies.robustness.plan import attacked_presets
from studies.study import RESULTS_FILE

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "robustness"


def test_every_flock_preset_without_learned_predators_is_surveyed() -> None:
    expected = [
        name
        for name, (_, scenario) in PRESETS.items()
        if isinstance(scenario, FlockScenario) and name not in {"learned-predator", *LITERATURE}
    ]
    assert list(attacked_presets()) == expected
    assert list(attacked_presets(["pursuit"])) == ["pursuit"]
    for name in ("paper-line", "learned-predator", "wings"):
        with pytest.raises(ArgumentError, match="presets"):
            attacked_presets([name])
    with pytest.raises(ArgumentError, match="presets"):
        attacked_presets([])


def results_of(values: np.ndarray) -> dict[str, np.ndarray]:
    return {
        "min_mean_distance": values,
        "min_min_distance": values / 10,
        "num_components": np.ones(values.shape, int),
    }


def test_the_range_is_chosen_and_measured_on_different_flocks() -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(size=(4, 80)) * 0.1 + np.array([[0.0], [0.0], [5.0], [0.0]])
    values[3, 40:] += 50.0  # the best range on the second half does not count
    found = outcome("J_mean", (0.0, 1.0, 2.0, 3.0), results_of(values))
    assert (found.best.mean, found.best.low, found.best.high) == (2.0, 2.0, 2.0)
    told = values[:, 40:]
    assert found.value("J_mean").mean == pytest.approx(told[2].mean())
    assert found.value("J_min").mean == pytest.approx(told[2].mean() / 10)
    assert found.at_zero.mean == pytest.approx(told[0].mean())
    assert found.at_longest.mean == pytest.approx(told[3].mean())
    assert found.gain_over_zero.mean == pytest.approx((told[2] - told[0]).mean())
    assert found.gain_over_longest.mean == pytest.approx((told[2] - told[3]).mean())
    assert [point.mean for point in found.curve] == pytest.approx(told.mean(axis=1))
    assert found.finding is Finding.LIKE_LONGEST


@pytest.mark.parametrize(
    ("over_zero", "over_longest", "expected"),
    [
        (0.1, 0.1, Finding.INTERIOR),
        (0.0, 0.1, Finding.LIKE_ZERO),
        (0.1, 0.0, Finding.LIKE_LONGEST),
        (-0.1, 0.0, Finding.LIKE_BOTH),
    ],
)
def test_findings_follow_one_rule(over_zero: float, over_longest: float, expected: Finding) -> None:
    some = Estimate(1.0, 0.0, 2.0)
    found = Outcome(
        best=some,
        min_mean_distance=some,
        min_min_distance=some,
        at_zero=some,
        at_longest=some,
        gain_over_zero=Estimate(1.0, over_zero, 2.0),
        gain_over_longest=Estimate(1.0, over_longest, 2.0),
        curve=(),
    )
    assert found.finding is expected


def test_a_tiny_survey_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "robustness"
    flags = (
        "--num-flocks",
        "2",
        "--presets",
        "paper-flock",
        "pursuit",
        "--output",
        str(output),
        "--backend",
        "serial",
    )
    ran = Ran(capsys, "robustness", *flags, "--json", run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    text = (output / RESULTS_FILE).read_text("utf-8")
    results = RobustnessResults.from_json(text)
    assert results.to_json() == text
    assert json.loads(ran.out)["results"] == json.loads(text)
    assert results.command == "python -m studies robustness --num-flocks 2 --presets paper-flock pursuit"
    assert {path.name for path in output.iterdir()} == {
        RESULTS_FILE,
        "cache",
        "robustness.md",
        "robustness.png",
        "robustness.svg",
    }
    page = (output / "robustness.md").read_text("utf-8")
    assert page == markdown_page(results, output, output / "robustness.md")
    for row in results.presets:
        told = sweep(attacked_presets()[row.name], row.grid.actions, range(2, 4))
        means = [point.mean for point in row.outcomes["J_mean"].curve]
        assert means == pytest.approx(told.min_mean_distance.mean(axis=1), abs=1e-9)
        means = [point.mean for point in row.outcomes["J_min"].curve]
        assert means == pytest.approx(told.min_min_distance.mean(axis=1), abs=1e-9)
        assert page.count(f"| {row.name} |") == 5  # two tables for J_mean, two for J_min, the description
    for symbol in ("J_mean", "J_min"):
        for answer in answers(results, symbol):
            assert f"| {answer.question} | {answer} |" in page

    stamps = {path: path.stat().st_mtime_ns for path in (output / "cache").iterdir()}
    again = Ran(capsys, "robustness", *flags, run=STUDIES.main)
    assert again.code == Exit.DONE
    assert "paper-flock" in again.out
    assert {path: path.stat().st_mtime_ns for path in (output / "cache").iterdir()} == stamps
    assert (output / RESULTS_FILE).read_text("utf-8") == text


def test_the_committed_page_follows_from_the_committed_results() -> None:
    results = RobustnessResults.load(COMMITTED)
    page = ROOT / "docs" / "robustness.md"
    assert page.read_text("utf-8") == markdown_page(results, COMMITTED, page)
    assert results.num_flocks >= 500
    assert {row.name for row in results.presets} == set(attacked_presets())
    assert (COMMITTED / "robustness.png").is_file()
