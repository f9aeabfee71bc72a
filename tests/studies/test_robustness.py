"""The robustness study: the best fixed range in every preset, the rule of its findings, and its page."""

import json
from pathlib import Path

import numpy as np
import pytest
from cli_runs import Ran

from flockesc_env import PRESETS, FlockScenario, sweep
from flockesc_env.cli.exits import Exit
from flockesc_env.common.errors import InputError
from flockesc_env.common.stats import Estimate
from flockesc_env.scenario.presets import LITERATURE, OF_TASKS
from studies.__main__ import STUDIES
from studies.robustness.plan import attacked_presets
from studies.robustness.survey import Choice, Finding, RobustnessResults, markdown_page, outcome
from studies.study import RESULTS_FILE, document

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "robustness"


def test_every_flock_preset_without_learned_predators_is_surveyed() -> None:
    flocks = [name for name, (_, scenario) in PRESETS.items() if isinstance(scenario, FlockScenario)]
    excluded = {"learned-predator", *LITERATURE, *OF_TASKS}
    assert list(attacked_presets()) == [name for name in flocks if name not in excluded]
    assert list(attacked_presets(["pursuit"])) == ["pursuit"]
    for names in (["paper-line"], ["learned-predator"], ["wings"], []):
        with pytest.raises(InputError, match="presets"):
            attacked_presets(names)


def test_the_range_is_chosen_and_measured_on_different_flocks() -> None:
    rng = np.random.default_rng(0)
    values = rng.normal(size=(4, 80)) * 0.1 + np.array([[0.0], [0.0], [5.0], [0.0]])
    values[3, 40:] += 50.0  # the best range on the second half does not count
    results = {"min_mean_distance": values, "min_min_distance": values / 10}
    found = outcome("J_mean", (0.0, 1.0, 2.0, 3.0), results)
    assert (found.best.mean, found.best.low, found.best.high) == (2.0, 2.0, 2.0)
    means = values[:, 40:].mean(axis=1)
    assert found.min_mean_distance.mean == pytest.approx(means[2])
    assert found.min_min_distance.mean == pytest.approx(means[2] / 10)
    assert (found.at_zero.mean, found.at_longest.mean) == pytest.approx((means[0], means[3]))
    assert found.gain_over_zero.mean == pytest.approx(means[2] - means[0])
    assert found.gain_over_longest.mean == pytest.approx(means[2] - means[3])
    assert [point.mean for point in found.curve] == pytest.approx(means)
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
    some, gains = Estimate(1.0, 0.0, 2.0), (Estimate(1.0, low, 2.0) for low in (over_zero, over_longest))
    assert Choice(some, 0, some, *gains).finding is expected


def test_a_tiny_survey_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "robustness"
    flags = ["--num-flocks", 2, "--presets", "paper-flock", "pursuit", "--output", output]
    ran = Ran(capsys, "robustness", *flags, "--backend", "serial", "--json", run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    text = (output / RESULTS_FILE).read_text("utf-8")
    results = RobustnessResults.load(output)
    assert document(results) == text
    assert ran.json()["results"] == json.loads(text)
    assert results.command == "python -m studies robustness --num-flocks 2 --presets paper-flock pursuit"
    page = (output / "robustness.md").read_text("utf-8")
    assert page == markdown_page(results, output, output / "robustness.md")
    assert (output / "robustness.png").is_file()
    for row in results.presets:
        measured = sweep(attacked_presets()[row.name], row.grid.actions, range(2, 4))
        assert page.count(f"\n| {row.question} | ") == 2
        for symbol, objective in (("J_mean", "min_mean_distance"), ("J_min", "min_min_distance")):
            means = [point.mean for point in row.outcomes[symbol].curve]
            assert means == pytest.approx(measured.values(objective).mean(axis=1), abs=1e-9)

    stamps = {path: path.stat().st_mtime_ns for path in (output / "cache").iterdir()}
    again = Ran(capsys, "robustness", *flags, run=STUDIES.main)
    assert "paper-flock" in again.out
    assert {path: path.stat().st_mtime_ns for path in (output / "cache").iterdir()} == stamps
    assert (output / RESULTS_FILE).read_text("utf-8") == text


def test_the_committed_page_follows_from_the_committed_results() -> None:
    results = RobustnessResults.load(COMMITTED)
    page = ROOT / "docs" / "robustness.md"
    assert page.read_text("utf-8") == markdown_page(results, COMMITTED, page)
    assert {row.name for row in results.presets} == set(attacked_presets())
