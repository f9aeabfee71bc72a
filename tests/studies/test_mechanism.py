"""What the pages say about how policies work: flying apart, flocks without fear, the value of candidates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

import flockesc_env as fe
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Cache, find_backend
from studies.findings.dispersal import dispersal
from studies.findings.fear import RULES, fear_figures, measure_fear
from studies.findings.information import SENSING, draw_information, measure_information, objective
from studies.findings.named import Named, largest_turn
from studies.findings.results import load_study
from studies.findings.summary import summarize
from studies.measurements import Runner

COMMITTED = Path(__file__).parents[2] / "results" / "findings"


def test_flying_apart() -> None:
    flocks = HELD_OUT[:2]
    found = dispersal(flocks)
    np.testing.assert_array_equal(
        found["witnesses"], fe.rollout(None, "stubborn-witnesses", flocks).min_mean_distance
    )
    assert (found["witnesses"] != found["unseen"]).any()
    for flock, values in enumerate(zip(*(found[f"outward_{start}"] for start in (0, 1, 2)), strict=True)):
        assert values[0] > values[1] > values[2]
        start = fe.simulate(fe.FlockScenario(num_steps=1), 0.0, seed=flocks[flock])
        (predator,) = start.scenario.predators
        distances = []
        for step in range(fe.FlockScenario().num_steps + 1):
            time = step * fe.FlockScenario().time_step
            place = np.array(predator.position) + time * np.array(predator.velocity)
            agents = []
            for position, velocity in zip(start.positions[0], start.velocities[0], strict=True):
                out = position - start.positions[0].mean(axis=0)
                now = position + time * np.linalg.norm(velocity) * out / np.linalg.norm(out)
                agents.append(np.linalg.norm(now - place))
            distances.append(np.mean(agents))
        assert values[0] == pytest.approx(min(distances), abs=1e-6)


@pytest.mark.parametrize("neighbors", [1, 2])
def test_the_largest_turn_is_that_of_the_model(neighbors: int) -> None:
    """All neighbors head alike, at most 0.1 degrees off the best heading among these."""
    angles = []
    for heading in np.radians(np.arange(90.0, 180.0, 0.1)):
        others = [(np.cos(heading), np.sin(heading))] * neighbors
        flock = fe.FlockScenario(
            num_agents=1 + neighbors,
            num_steps=1,
            initial_positions=fe.GivenPositions(((0.0, 0.0),) * (1 + neighbors)),
            initial_headings=fe.GivenHeadings(((1.0, 0.0), *others)),
            predators=(),
        )
        along, across = fe.simulate(flock, 1.0, seed=0).velocities[-1][0]
        angles.append(np.degrees(np.arctan2(across, along)))
    assert max(angles) < largest_turn(neighbors) + 1e-9
    assert max(angles) == pytest.approx(largest_turn(neighbors), abs=0.02)
    assert largest_turn(neighbors) == pytest.approx({1: 26.565, 2: 30.0}[neighbors], abs=1e-3)


def test_named_numbers_are_those_of_the_tables() -> None:
    settings = ("per-agent-visible", "per-agent-visible-derived")
    named = Named(summarize(load_study(COMMITTED / name) for name in settings))
    tables = [pl.read_parquet(COMMITTED / name / "episodes.parquet") for name in settings]
    fixed = tables[0].filter(policy="best fixed range")["objective"].to_numpy().mean()
    ppo, other = (table.filter(policy="ppo")["objective"].to_numpy().mean() for table in tables)
    assert named.objective(settings[0], "ppo") == f"{ppo:.1f} m"
    assert named.gain(settings[0], "ppo", "best fixed range").startswith(f"{ppo - fixed:+.2f} [")
    assert named.gain(settings[1], "ppo", "ppo", settings[0], sign="").startswith(f"{other - ppo:.2f} [")
    references = pl.read_parquet(COMMITTED / settings[0] / "references.parquet")
    bounds = references.filter(reference="free headings")["objective"].to_numpy()
    bound = named.bound(settings[0])
    assert (bound.mean, bound.highest) == pytest.approx((bounds.mean(), bounds.max()))
    assert bound.above == pytest.approx((bounds > bounds.mean()).mean())
    assert named.has(*settings)
    assert not named.has("shared")


SETTING = "per-agent-visible"


def test_policies_play_the_same_flocks_with_and_without_the_force(tmp_path: Path) -> None:
    (tmp_path / SETTING).symlink_to(COMMITTED / SETTING)
    file = measure_fear(tmp_path, 3, Runner(Cache(tmp_path / "cache"), find_backend("serial")))
    table = pl.read_parquet(file)
    assert table["policy"].unique(maintain_order=True).to_list() == [SETTING, *RULES]
    calm = table.filter(policy="head-away", strength=0.0)
    expected = fe.rollout(
        fe.FlockScenario(repulsion_strength=0.0), "head-away", HELD_OUT[:3]
    ).min_mean_distance
    np.testing.assert_array_equal(calm["objective"].to_numpy(), expected)
    fleeing = table.filter(policy="head-away", strength=10.0)
    expected = fe.rollout(None, "head-away", HELD_OUT[:3]).min_mean_distance
    np.testing.assert_array_equal(fleeing["objective"].to_numpy(), expected)
    found = fear_figures(file)["head-away"]
    assert found["force"].mean == pytest.approx(found["fleeing"].mean - found["fearless"].mean)
    gain = (fleeing["objective"] - fleeing["fixed"]).mean()
    assert found["gain_fleeing"].mean == pytest.approx(gain)


def test_every_number_of_candidates_plays_the_same_flocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studies.findings.information._COUNTS", (0, 1, 4))
    file = measure_information(tmp_path, 2, Runner(Cache(tmp_path / "cache"), find_backend("serial")))
    table = pl.read_parquet(file)
    assert table.group_by("sensing", "candidates").len()["len"].to_list() == [2] * len(SENSING) * 3
    fixed = fe.rollout(None, "fixed:12", HELD_OUT[:2]).min_mean_distance
    assert table.filter(candidates=0)["objective"].to_list() == fixed.tolist() * len(SENSING)
    seen = table.filter(candidates=4, sensing="any distance")["objective"].to_numpy()
    assert (seen > fixed).all()
    assert seen.tolist() == objective("any distance", 4, HELD_OUT[:2])["objective"].tolist()
    (axes,) = draw_information(file).axes
    lines = {tuple(line.get_ydata()) for line in axes.lines}
    assert len(lines) == len(SENSING)
