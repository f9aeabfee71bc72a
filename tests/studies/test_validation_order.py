"""Order against angular noise: small flocks, and verdicts on made-up measurements."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flockesc_env import simulate
from flockesc_env.jobs import Arrays, Job
from studies.validation import vicsek
from studies.validation.page import markdown_page
from studies.validation.results import Measured, ValidationResults, Verdict


def page_of(name: str, results: Any) -> str:
    measured = ValidationResults({name: Measured("command", {}, 1.0, results)})
    return markdown_page(ValidationResults.from_json(measured.to_json()), Path("figures"), Path("page.md"))


def played(jobs: dict[str, list[Job]]) -> dict[str, Arrays]:
    """Run the jobs of every group and join their flocks."""
    found = {name: [job.run() for job in group] for name, group in jobs.items()}
    return {
        name: {key: np.concatenate([each[key] for each in parts], axis=1) for key in parts[0]}
        for name, parts in found.items()
    }


def test_order_is_a_mean_over_late_steps() -> None:
    flock = vicsek.periodic_flock(20, speed=0.03, num_steps=12)
    found = vicsek.mean_order(flock, [1.0, 5.0], 4, range(3, 5))
    late = simulate(flock.replace(angular_noise=5.0), 1.0, seed=4).polarization[4:]
    assert found["mean"][1, 1] == pytest.approx(late.mean())


def test_order_of_small_flocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vicsek, "SIZES", {10: 4, 60: 4})
    monkeypatch.setattr(vicsek, "CONTROL", 10)
    monkeypatch.setattr(vicsek, "NUM_STEPS", 400)
    monkeypatch.setattr(vicsek, "SKIP", 50)
    results = vicsek.results(played(vicsek.jobs(1.0)))
    assert all(row[0].mean == pytest.approx(1) for row in results.order)  # without noise
    assert [e.mean for e in results.independent] == pytest.approx([1, 1], abs=0.08)
    assert results.falls[1].high < results.falls[0].low
    page = page_of("vicsek", results)
    assert f"| 60 | {results.order[1][1]} |" in page
    assert len(vicsek.figure(results).axes) == 2


def measured_order(sharper: bool = True, scale: float = 1.0) -> dict[str, Arrays]:
    """Return made-up order that falls with noise, in large flocks faster if ``sharper``."""
    rng = np.random.default_rng(0)
    shape = {size: 0.5 if sharper and size > 1_000 else 1.0 for size in vicsek.SIZES}
    found = {}
    for size, fall in shape.items():
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
