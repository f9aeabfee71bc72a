"""Policies of a generation play as each of them does alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from option_table import small_flock
from small_runs import small_run

from flockesc_env import Architecture
from training.config import SearchArgs
from training.evaluation import objective
from training.families import Family, Networks, Witnesses

SCENARIO = small_flock(num_agents=6, num_steps=12, initial_side=60.0)
SEEDS = [4, 5]
INPUTS = ("time", "predator_sensed", "predator_direction_ahead", "predator_direction_left")
FAMILIES = {
    "networks": Networks(Architecture(INPUTS, memory=2)),
    "linear networks": Networks(Architecture(INPUTS, ())),
    "rules": Witnesses(max_range=30.0),
}


@pytest.mark.parametrize("family", FAMILIES.values(), ids=list(FAMILIES))
def test_a_generation_plays_as_its_policies_do(family: Family, tmp_path: Path) -> None:
    (tmp_path / "flock.toml").write_text(SCENARIO.to_toml())
    chosen = {
        "scenario": str(tmp_path / "flock.toml"),
        "per_agent": True,
        "max_range": 30.0,
        "predator_visible": False,
    }
    args = small_run(tmp_path / "run", "search", steps_per_action=1, **chosen)
    assert isinstance(args, SearchArgs)
    vectors = np.random.default_rng(0).normal(size=(3, family.size))
    for _ in range(2):  # the second run starts without the memory of the first
        together, num_actions = family.play(args, vectors, SEEDS)
        alone = np.array([objective(args, family.policy(vector), SEEDS) for vector in vectors])
        np.testing.assert_array_equal(together, alone)
    assert len(set(alone.ravel().round(3))) >= 3
    assert num_actions == 6 * SCENARIO.num_agents * SCENARIO.num_steps
