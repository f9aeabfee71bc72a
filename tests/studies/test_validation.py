"""Published results measured here: order against noise in small flocks, verdicts, page and command."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_runs import Ran

from flockesc_env import simulate, sweep
from flockesc_env.cli.exits import Exit
from flockesc_env.jobs import Arrays
from studies.__main__ import STUDIES
from studies.study import RESULTS_FILE, document
from studies.validation import Verdict, criticality, stable_range, vicsek, warning
from studies.validation.survey import ValidationResults, markdown_page

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "validation"


def test_the_committed_page_follows_from_the_committed_results() -> None:
    results = ValidationResults.load(COMMITTED)
    page = ROOT / "docs" / "validation.md"
    assert page.read_text("utf-8") == markdown_page(results, COMMITTED, page)
    assert document(results) == (COMMITTED / RESULTS_FILE).read_text("utf-8")
    gained = results.parts["warning"].results.paper[0]
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    assert f"still gains {gained.blocked[0].mean:.2f} of its {gained.hearing[0].mean:.2f} m over" in readme


def test_one_part_is_measured_and_the_others_keep_their_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    small = {"SIZES": {10: 4, 60: 4}, "CONTROL": 10, "NUM_STEPS": 400, "SKIP": 50}
    for name, value in small.items():
        monkeypatch.setattr(vicsek, name, value)
    stored = ValidationResults.load(COMMITTED)
    (tmp_path / RESULTS_FILE).write_text(document(stored))
    page = tmp_path / "validation.md"
    flags = ["--output", tmp_path, "--page", page, "--backend", "serial"]
    ran = Ran(capsys, "validation", "--only", "vicsek", *flags, run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    found = ValidationResults.load(tmp_path)
    assert list(found.parts) == list(stored.parts)
    assert found.parts["milling"] == stored.parts["milling"]
    assert found.parts["vicsek"].command == "python -m studies validation --only vicsek"
    assert (tmp_path / "vicsek.png").is_file()
    assert page.read_text("utf-8") == markdown_page(found, tmp_path, page)
    measured = found.parts["vicsek"].results
    assert measured.num_flocks == (4, 4)
    assert all(row[0].mean == pytest.approx(1) for row in measured.order)  # without noise
    assert [e.mean for e in measured.independent] == pytest.approx([1, 1], abs=0.08)
    assert measured.falls[1].high < measured.falls[0].low


@pytest.mark.parametrize("flags", [["--only", "wings"], ["--scale", "0"]], ids=lambda flags: flags[0])
def test_unknown_parts_and_shares_are_refused(flags: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, "validation", *flags, run=STUDIES.main)
    assert ran.code == Exit.REFUSED
    assert flags[0].strip("-") in ran.err


def test_order_is_a_mean_over_late_steps() -> None:
    flock = vicsek.periodic_flock(20, speed=0.03, num_steps=12)
    found = vicsek.mean_order(flock, [1.0, 5.0], 4, range(3, 5))
    late = simulate(flock.replace(angular_noise=5.0), 1.0, seed=4).polarization[4:]
    assert found["mean"][1, 1] == pytest.approx(late.mean())


def measured_order(sharper: bool = True, scale: float = 1.0) -> dict[str, Arrays]:
    """Return made-up order that falls with noise, in large flocks faster if ``sharper``."""
    rng = np.random.default_rng(0)
    found = {}
    for size in vicsek.SIZES:
        fall = 0.5 if sharper and size > 1_000 else 1.0
        mean = np.array([1.0, 0.9, 0.8, 0.7, 0.6 * fall, 0.5 * fall, 0.4 * fall, 0.3 * fall, 0.0])
        mean[-1] = vicsek.exact(size) * scale
        found[str(size)] = {"mean": mean[:, None] * (1 + 1e-3 * rng.normal(size=(9, 6)))}
    return found | {"random": found[str(vicsek.CONTROL)]}


@pytest.mark.parametrize(
    ("fields", "verdict"),
    [({}, Verdict.AGREES), ({"sharper": False}, Verdict.DIFFERS), ({"scale": 1.2}, Verdict.DIFFERS)],
)
def test_verdict_on_order(fields: dict[str, Any], verdict: Verdict) -> None:
    assert vicsek.verdict(vicsek.results(measured_order(**fields))) == verdict


@pytest.mark.parametrize(
    ("least", "rise", "obstacle"),
    [(10.0, 2.0, ""), (20.0, 2.0, "flight avoids"), (10.0, 0.0, "the interval")],
)
def test_verdict_on_captures(least: float, rise: float, obstacle: str) -> None:
    """Captures of agents that flee rise from the transition; those of agents that do not, from 20 by 2."""
    rng, measured = np.random.default_rng(0), {}
    for index, alignment in enumerate(criticality.ALIGNMENTS):
        away, order, noise = abs(index - 4), np.ones(6), rng.normal(size=(2, 6))
        caught = np.array([[least + rise * away], [20 + 2 * away]]) + noise
        measured[alignment] = {"numbers": np.array([order, order * (away == 0), *caught, order])}
    results = criticality.results(measured)
    found = criticality.obstacles(results)
    assert [each.startswith(obstacle) for each in found] == [True] * bool(obstacle)
    assert criticality.verdict(results) == (Verdict.CANNOT_BE_JUDGED if obstacle else Verdict.AGREES)


def test_a_warning_is_what_agents_in_range_of_the_predator_say() -> None:
    """Without agents in range, or without ranges, nothing is blocked."""
    for sensing, is_blocked in ((0.0, False), (60.0, True)):
        found = warning.play(dataclasses.replace(warning.PAPER, sensing=sensing), range(2))
        for name in warning.PAPER.objectives:
            hearing, blocked = found[f"hearing {name}"], found[f"blocked {name}"]
            assert (hearing[1:] != blocked[1:]).any() == is_blocked
            np.testing.assert_array_equal(hearing[0], blocked[0])


@pytest.mark.parametrize(("removed", "verdict"), [(0.2, Verdict.DIFFERS), (1.0, Verdict.AGREES)])
def test_verdict_on_warnings(removed: float, verdict: Verdict) -> None:
    """The best range gains 4 over both ends, and blocking takes a part of it away."""
    rng, gain, measured = np.random.default_rng(0), np.zeros((len(warning.RANGES), 1)), {}
    gain[3] = 4.0
    for key in warning.jobs(1.0):
        noise = rng.normal(scale=0.1, size=6)
        shares = {"hearing": 1.0, "blocked": 1.0 - removed}
        names = [(name, one) for name in shares for one in key[0].objectives]
        measured[key] = {f"{name} {one}": shares[name] * gain + noise for name, one in names}
    found = warning.results(measured)
    assert warning.verdict(found) == verdict
    assert {each.best for each in found.worlds} == {warning.RANGES[3]}
    assert len(found.decided) == (len(found.worlds) if removed == 1.0 else 0)


def test_payoffs_of_agents_add_up_to_the_objectives_of_the_flock() -> None:
    seeds = range(3, 5)
    now, nearest, alive = stable_range.payoffs(10.0, seeds)[:, :, stable_range.RANGES.index(10.0)]
    free, hunted = (sweep(scenario, [10.0], seeds) for scenario in (stable_range.PREY, stable_range.CAUGHT))
    np.testing.assert_allclose(now.mean(axis=-1), free.min_mean_distance[0], rtol=1e-12)
    np.testing.assert_allclose(nearest.min(axis=-1), free.min_min_distance[0], rtol=1e-12)
    np.testing.assert_allclose(alive.mean(axis=-1), hunted.fraction_surviving[0], rtol=1e-12)


@pytest.mark.parametrize(("lead", "verdict"), [(0.0, Verdict.AGREES), (1.0, Verdict.DIFFERS)])
def test_verdict_on_mutants_that_win_with_the_next_larger_range(lead: float, verdict: Verdict) -> None:
    rng, size = np.random.default_rng(0), len(stable_range.RANGES)
    measured = {}
    for key in stable_range.jobs(1.0):
        at = stable_range.RANGES.index(key[1])
        wins = np.where(np.arange(size) == (at + 1) % size, lead, -lead) * np.ones((3, 6, 1))
        group = 9.0 - abs(at - 2) + 0.1 * rng.normal(size=(3, 6))
        measured[key] = {"group": group, "gain": wins, "advantage": wins, "shuffled": 0 * wins}
    found = stable_range.results(measured)
    assert stable_range.verdict(found) == verdict
    game = found.games["distance"]
    assert game.best.mean == stable_range.RANGES[2]
    assert sorted(game.cycle) == list(stable_range.RANGES if lead else stable_range.RANGES[2:3])
