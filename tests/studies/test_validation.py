"""Published results measured here: the parts, their verdicts, the page and its command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_runs import Ran

from flockesc_env.cli.exits import Exit
from flockesc_env.common.stats import Estimate
from studies.__main__ import STUDIES
from studies.study import RESULTS_FILE
from studies.validation import attack_speed, robust_consensus
from studies.validation.page import markdown_page
from studies.validation.results import ValidationResults, Verdict
from studies.validation.robust_consensus import Optimum, points, squared_norm

ROOT = Path(__file__).parents[2]
COMMITTED = ROOT / "results" / "validation"


def test_the_committed_page_follows_from_the_committed_results() -> None:
    results = ValidationResults.load(COMMITTED)
    page = ROOT / "docs" / "validation.md"
    assert page.read_text("utf-8") == markdown_page(results, COMMITTED, page)
    assert results.to_json() == (COMMITTED / RESULTS_FILE).read_text("utf-8")
    assert all((COMMITTED / f"{name}.png").is_file() for name in results.parts)


def test_one_part_is_measured_and_the_others_keep_their_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robust_consensus, "SIZES", {12: 4, 20: 4})
    monkeypatch.setattr(robust_consensus, "FEW", 12)
    monkeypatch.setattr(robust_consensus, "NEIGHBORS", (3, 4, 5))
    stored = ValidationResults.load(COMMITTED)
    (tmp_path / RESULTS_FILE).write_text(stored.to_json())
    page = tmp_path / "validation.md"
    flags = ["--output", str(tmp_path), "--page", str(page), "--backend", "serial"]
    ran = Ran(capsys, "validation", "--only", "robust_consensus", *flags, run=STUDIES.main)
    assert ran.code == Exit.DONE, ran.err
    found = ValidationResults.load(tmp_path)
    assert list(found.parts) == list(stored.parts)
    assert found.parts["attack_speed"] == stored.parts["attack_speed"]
    measured = found.parts["robust_consensus"]
    assert measured.results.num_flocks == (4, 4)
    assert measured.minutes is not None
    assert (tmp_path / "robust_consensus.png").is_file()
    assert page.read_text("utf-8") == markdown_page(found, tmp_path, page)


@pytest.mark.parametrize("flags", [["--only", "wings"], ["--scale", "0"]], ids=lambda flags: flags[0])
def test_unknown_parts_and_shares_are_refused(flags: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    ran = Ran(capsys, "validation", *flags, run=STUDIES.main)
    assert ran.code != Exit.DONE
    assert flags[0].strip("-") in ran.err


def test_the_norm_is_that_of_graphs_with_a_known_one() -> None:
    n = 7
    everybody = np.array([(i, j) for i in range(n) for j in range(n) if i != j])
    assert squared_norm(everybody, n) == pytest.approx((n - 1) / (2 * n))
    ring = np.array([(i, (i + 1) % n) for i in range(n)])
    assert squared_norm(ring, n) == pytest.approx((n**2 - 1) / 12)


def test_the_norm_is_finite_if_one_agent_is_heard_by_all() -> None:
    leader = np.array([(1, 0), (2, 0)])
    assert squared_norm(leader, 3) == pytest.approx(1.0)
    followers_of_two = np.array([(2, 0), (2, 1)])
    assert squared_norm(followers_of_two, 3) == np.inf


def test_spaced_points_keep_their_distance() -> None:
    placed = points(3, 40, 0.2, 0.6)
    least = 0.6 * (0.2 * robust_consensus.WIDTH_RATIO / 40) ** (1 / 3)
    assert min(np.linalg.norm(a - b) for at, a in enumerate(placed) for b in placed[:at]) >= least
    assert (placed.max(axis=0) <= [0.2, robust_consensus.WIDTH_RATIO, 1.0]).all()


@pytest.mark.parametrize(
    ("best", "thickness", "size", "expected"),
    [
        ((5.8, 7.2), (-3.0, -1.0), (-0.8, 0.8), Verdict.AGREES),
        ((8.0, 9.0), (-3.0, -1.0), (-0.8, 0.8), Verdict.DIFFERS),
        ((5.8, 7.2), (-3.0, -1.0), (0.1, 0.8), Verdict.DIFFERS),
        ((5.8, 7.2), (-1.0, 1.0), (-0.8, 0.8), Verdict.OPEN),
        ((5.8, 7.2), (-3.0, -1.0), (-1.2, 0.8), Verdict.OPEN),
        ((5.8, 8.2), (-3.0, -1.0), (-0.8, 0.8), Verdict.OPEN),
    ],
)
def test_verdicts_on_the_best_number_follow_the_rule(
    best: tuple[float, float], thickness: tuple[float, float], size: tuple[float, float], expected: Verdict
) -> None:
    found = Optimum(
        thickness=(Estimate(6.5, *best),) * len(robust_consensus.THICKNESSES),
        thickness_change=Estimate(0.0, *thickness),
        size=(),
        size_change=Estimate(0.0, *size),
        spaced=Estimate(5.0, 5.0, 5.0),
        curve=(),
    )
    assert found.verdict is expected


@pytest.mark.parametrize(
    ("gains", "expected"),
    [
        ((1.0, -1.0), Verdict.AGREES),
        ((-1.0, -1.0), Verdict.DIFFERS),
        ((1.0, 1.0), Verdict.DIFFERS),
        ((0.0, -1.0), Verdict.OPEN),
    ],
)
def test_verdicts_on_the_speed_follow_the_signs_at_both_ends(
    gains: tuple[float, float], expected: Verdict
) -> None:
    some = Estimate(1.0, 1.0, 1.0)
    best = [attack_speed.Best(some, some, some, (Estimate(gain, gain - 0.5, gain + 0.5),)) for gain in gains]
    assert attack_speed.sign_changes(best) is expected


def made_up(best: dict[float, int], seed: int, flocks: int) -> dict[str, Any]:
    """Return objectives whose largest mean is at a given k, by speed."""
    rng = np.random.default_rng(seed)
    found = {}
    for speed, k in best.items():
        distance = np.abs(np.log(np.array(attack_speed.NEIGHBORS) / k))[:, None]
        values = 50 - distance + 0.01 * rng.normal(size=(len(attack_speed.NEIGHBORS), flocks))
        found[str(speed)] = {"min_mean_distance": values, "min_min_distance": -values}
    return found


def test_the_best_k_is_chosen_on_tuning_flocks_and_measured_on_held_out_ones() -> None:
    tuning = made_up({0.5: 100, 1.0: 30, 2.0: 10, 4.0: 3}, 0, 20)
    held_out = made_up({0.5: 100, 1.0: 30, 2.0: 10, 4.0: 2}, 1, 40)
    measured = {f"tuning {speed}": columns for speed, columns in tuning.items()}
    measured |= {f"held out {speed}": columns for speed, columns in held_out.items()}
    for speed, columns in tuning.items():
        measured[f"longer {speed}"] = {name: values[:, :4] - 0.25 for name, values in columns.items()}
    results = attack_speed.results(measured)
    assert [row.neighbors.mean for row in results.best["J_mean"]] == [100, 30, 10, 3]
    assert (results.tuning_flocks, results.num_flocks) == (20, 40)
    fastest = results.best["J_mean"][-1]
    values = held_out["4.0"]["min_mean_distance"]
    at = {k: values[attack_speed.NEIGHBORS.index(k)].mean() for k in (1, 3, 100)}
    assert fastest.value.mean == pytest.approx(at[3])
    assert fastest.gain_over_most.mean == pytest.approx(at[3] - at[100])
    assert fastest.curve[attack_speed.NEIGHBORS.index(3)].mean == pytest.approx(at[3] - at[1])
    assert results.falls["J_mean"] == 1
    assert results.longer["J_mean"] == pytest.approx((0.25,) * len(attack_speed.SPEEDS))
