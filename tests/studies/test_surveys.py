"""The studies of robustness and of published results; the committed reports of all studies."""

import dataclasses
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from cli_runs import Cli

from flockesc_env import PRESETS, FlockScenario, simulate, sweep
from flockesc_env.cli.output import Exit
from flockesc_env.common.errors import InputError
from flockesc_env.scenario import ConstantVelocity
from flockesc_env.scenario.presets import LITERATURE, OF_TASKS
from studies.__main__ import STUDIES
from studies.findings.report import FINDINGS
from studies.paper.report import PAPER
from studies.robustness import attacked_presets
from studies.robustness.survey import ROBUSTNESS, Finding, RobustnessResults, outcome
from studies.scaling import flocks, law, survey
from studies.scaling.survey import SCALING
from studies.study import REPORT, RESULTS_FILE, document
from studies.validation import stable_range, vicsek, warning
from studies.validation.survey import VALIDATION, ValidationResults

ROOT = Path(__file__).parents[2]
REPORTED = {
    "paper": PAPER,
    "robustness": ROBUSTNESS,
    "scaling": SCALING,
    "validation": VALIDATION,
    "findings": FINDINGS,
}


def test_every_flock_preset_without_learned_predators_is_surveyed() -> None:
    flocks = [name for name, known in PRESETS.items() if known.model is FlockScenario]
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


def test_a_tiny_survey_end_to_end(tmp_path: Path, cli: Cli) -> None:
    output = tmp_path / "robustness"
    flags = ["--num-flocks", 2, "--presets", "paper-flock", "pursuit", "--output", output]
    ran = cli("robustness", *flags, "--backend", "serial", run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    text = (output / RESULTS_FILE).read_text("utf-8")
    results = RobustnessResults.load(output)
    assert document(results) == text
    assert results.command == "python -m studies robustness --num-flocks 2 --presets paper-flock pursuit"
    page = (output / REPORT).read_text("utf-8")
    assert page == ROBUSTNESS.report(results)
    assert (output / "robustness.png").is_file()
    for row in results.presets:
        measured = sweep(attacked_presets()[row.name], row.grid.actions, range(2, 4))
        assert page.count(f"\n| {row.question} | ") == 2
        for symbol, objective in (("J_mean", "min_mean_distance"), ("J_min", "min_min_distance")):
            means = [point.mean for point in row.outcomes[symbol].curve]
            assert means == pytest.approx(measured.values(objective).mean(axis=1), abs=1e-9)

    stamps = {path: path.stat().st_mtime_ns for path in (output / "cache").iterdir()}
    assert cli("robustness", *flags, run=STUDIES.main).code == Exit.DONE
    assert {path: path.stat().st_mtime_ns for path in (output / "cache").iterdir()} == stamps
    assert (output / RESULTS_FILE).read_text("utf-8") == text


@pytest.mark.parametrize("name", REPORTED)
def test_the_committed_report_follows_from_its_results(name: str) -> None:
    study, folder = REPORTED[name], ROOT / "results" / name
    assert (folder / REPORT).read_text("utf-8") == study.report(study.load(folder))


def test_committed_surveys_are_complete() -> None:
    assert {row.name for row in RobustnessResults.load(ROOT / "results/robustness").presets} == set(
        attacked_presets()
    )
    committed = ROOT / "results" / "validation"
    assert document(ValidationResults.load(committed)) == (committed / RESULTS_FILE).read_text("utf-8")


def test_one_part_is_measured_and_the_others_keep_their_results(
    tmp_path: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = {"SIZES": {10: 4, 60: 4}, "CONTROL": 10, "NUM_STEPS": 400, "SKIP": 50}
    for name, value in small.items():
        monkeypatch.setattr(vicsek, name, value)
    stored = ValidationResults.load(ROOT / "results" / "validation")
    (tmp_path / RESULTS_FILE).write_text(document(stored))
    flags = ["--output", tmp_path, "--backend", "serial"]
    ran = cli("validation", "--only", "vicsek", *flags, run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    found = ValidationResults.load(tmp_path)
    assert list(found.parts) == list(stored.parts)
    assert found.parts["milling"] == stored.parts["milling"]
    assert found.parts["vicsek"].command == "python -m studies validation --only vicsek"
    assert (tmp_path / "vicsek.png").is_file()
    assert (tmp_path / REPORT).read_text("utf-8") == VALIDATION.report(found)
    measured = found.parts["vicsek"].results
    assert measured.num_flocks == (4, 4)
    assert all(row[0].mean == pytest.approx(1) for row in measured.order)  # without noise
    assert [e.mean for e in measured.independent] == pytest.approx([1, 1], abs=0.08)
    assert measured.falls[1].high < measured.falls[0].low


@pytest.mark.parametrize("flags", [["--only", "wings"], ["--scale", "0"]], ids=lambda flags: flags[0])
def test_unknown_parts_and_shares_are_refused(flags: list[str], cli: Cli) -> None:
    ran = cli("validation", *flags, run=STUDIES.main)
    assert ran.code == Exit.REFUSED
    assert flags[0].strip("-") in ran.err


def test_order_is_a_mean_over_late_steps() -> None:
    flock = vicsek.periodic_flock(20, speed=0.03, num_steps=12)
    found = vicsek.mean_order(flock, [1.0, 5.0], 4, range(3, 5))
    late = simulate(flock.replace(angular_noise=5.0), 1.0, seed=4).polarization[4:]
    assert found["mean"][1, 1] == pytest.approx(late.mean())


def test_a_warning_is_what_agents_in_range_of_the_predator_say() -> None:
    """Without agents in range, or without ranges, nothing is blocked."""
    for sensing, is_blocked in ((0.0, False), (60.0, True)):
        found = warning.play(dataclasses.replace(warning.PAPER, sensing=sensing), range(2))
        for name in warning.PAPER.objectives:
            hearing, blocked = found[f"hearing {name}"], found[f"blocked {name}"]
            assert (hearing[1:] != blocked[1:]).any() == is_blocked
            np.testing.assert_array_equal(hearing[0], blocked[0])


def test_payoffs_of_agents_add_up_to_the_objectives_of_the_flock() -> None:
    seeds = range(3, 5)
    ranges = np.full((len(seeds), 1, stable_range.PREY.num_agents), stable_range.RANGES.index(10.0))
    now, nearest, alive = (one[:, 0] for one in stable_range.payoffs(ranges, seeds).values())
    free, hunted = (sweep(scenario, [10.0], seeds) for scenario in (stable_range.PREY, stable_range.CAUGHT))
    np.testing.assert_allclose(now.mean(axis=-1), free.min_mean_distance[0], rtol=1e-12)
    np.testing.assert_allclose(nearest.min(axis=-1), free.min_min_distance[0], rtol=1e-12)
    np.testing.assert_allclose(alive.mean(axis=-1), hunted.fraction_surviving[0], rtol=1e-12)


def test_the_ends_of_the_law_are_means_over_places_and_headings() -> None:
    rng, times = np.random.default_rng(0), np.linspace(0, 1.2, 61)
    starts, angles = rng.uniform(-0.5, 0.5, (2000, 2)), np.linspace(0, 2 * np.pi, 61)[1:]
    headings = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    moved = (times[:, None, None] * headings)[:, :, None] - (times - 0.8)[:, None, None, None]
    distances = np.linalg.norm(starts + moved, axis=3).mean(axis=2)
    found = law.ends(2, law.PAPER_SPEED)
    assert found.straight == found.alone == pytest.approx(distances.mean(axis=1).min(), abs=0.01)
    assert found.aligned == pytest.approx(distances.min(axis=0).mean(), abs=0.01)


def test_attacks_from_all_corners_are_the_mean_of_sweeps() -> None:
    flock = survey.cell(40, 2).scenario
    found = flocks.attacks(flock, (0.0, 0.1), (law.PAPER_SPEED,), range(2))
    runs = []
    for corner in itertools.product((1, -1), repeat=2):
        place, velocity = ([scale * one for one in corner] for scale in (-80, 10))
        predator = ConstantVelocity([50 + one for one in place], velocity)
        runs.append(sweep(flock.replace(predators=(predator,)), [0.0, 10.0], range(2)).min_mean_distance)
    np.testing.assert_allclose(100 * found["reached"][:, :, 0], np.mean(runs, axis=0), atol=0.05)
    turned = flocks.turns(survey.STILL.replace(num_agents=40), (0.0, 0.1), range(2))
    np.testing.assert_allclose(turned["through the center"], found["reached"][:, :, 0], rtol=1e-12)
    assert (turned["outward turn"][0] < 1e-3).all()
    fleeing = survey.cell(40, 2, fled=30.0).scenario
    found = flocks.attacks(fleeing, (0.1,), (law.PAPER_SPEED,), range(2))
    expected = sweep(fleeing, [10.0], range(2))
    np.testing.assert_allclose(100 * found["reached"][:, :, 0], expected.min_mean_distance, atol=0.05)
    np.testing.assert_array_equal(found["components"], expected.num_components)


def test_the_law_is_fitted_to_the_flocks_that_choose() -> None:
    results = survey.Scaling.load(ROOT / "results" / "scaling")
    curves = [(cell.scenario.num_agents, results.curve(name).first) for name, cell in survey.FITTED.items()]
    fitted = law.fit(np.array(survey.RANGES), curves)
    assert vars(fitted) == pytest.approx(vars(results.law), rel=1e-6)
    predicted = json.loads((ROOT / "results" / "scaling" / survey.PREDICTION_FILE).read_text())
    assert vars(results.law) == predicted["law"]
    stored = [results.curve(*cell).law for cell in survey.PREDICTED]
    np.testing.assert_allclose([*predicted["gains"].values()], stored, rtol=1e-12)
