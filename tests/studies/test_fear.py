"""Policies on flocks that do not flee."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from flockesc_env import FlockScenario, rollout
from flockesc_env.jobs import Cache, find_backend
from studies.learned.fear import RULES, fear_figures, measure_fear
from studies.measurements import Runner
from training.seeds import HELD_OUT

COMMITTED = Path(__file__).parents[2] / "results" / "learned"
SETTING = "per-agent-visible"


def test_policies_play_the_same_flocks_with_and_without_the_force(tmp_path: Path) -> None:
    (tmp_path / SETTING).symlink_to(COMMITTED / SETTING)
    file = measure_fear(tmp_path, 3, Runner(Cache(tmp_path / "cache"), find_backend("serial")))
    table = pl.read_parquet(file)
    assert table["policy"].unique(maintain_order=True).to_list() == [SETTING, *RULES]
    calm = table.filter(policy="head-away", strength=0.0)
    expected = rollout(FlockScenario(repulsion_strength=0.0), "head-away", HELD_OUT[:3]).min_mean_distance
    np.testing.assert_array_equal(calm["objective"].to_numpy(), expected)
    fleeing = table.filter(policy="head-away", strength=10.0)
    expected = rollout(None, "head-away", HELD_OUT[:3]).min_mean_distance
    np.testing.assert_array_equal(fleeing["objective"].to_numpy(), expected)
    found = fear_figures(file)["head-away"]
    assert found["force"].mean == pytest.approx(found["fleeing"].mean - found["fearless"].mean)
    gain = (fleeing["objective"] - fleeing["fixed"]).mean()
    assert found["gain_fleeing"].mean == pytest.approx(gain)
