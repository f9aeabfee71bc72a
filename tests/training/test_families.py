"""Policies of a generation play as each does alone; a search starts from a policy and restarts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from cmaes import CMA
from numpy.typing import NDArray
from option_table import small_flock
from small_runs import small_run
from training.config import SearchArgs, Setting
from training.evaluation import objective
from training.outputs import CURVE_FLOCKS
from training.record import CURVE_FILE

from flockesc_env import Architecture, load_policy
from flockesc_env.episodes.splits import TUNING, first_seeds
from flockesc_env.policies import BestCandidate, WinStayLoseShift
from training import search
from training.families import Family, Networks, Rules, family_of
from training.train import train

SCENARIO = small_flock(num_agents=6, num_steps=12, initial_side=60.0)
SEEDS = [4, 5]
INPUTS = ("time", "predator_sensed", "predator_direction_ahead", "predator_direction_left")
FAMILIES = {
    "networks": Networks(Architecture(INPUTS, memory=2)),
    "linear networks": Networks(Architecture(INPUTS, ())),
    "stubborn-witnesses": Rules("stubborn-witnesses", max_range=30.0),
    "win-stay-lose-shift-escape": Rules("win-stay-lose-shift-escape", max_range=30.0),
    "spread-out": Rules("spread-out", max_range=30.0),
}


@pytest.mark.parametrize("family", FAMILIES.values(), ids=list(FAMILIES))
def test_a_generation_plays_as_its_policies_do(family: Family, tmp_path: Path) -> None:
    (tmp_path / "flock.toml").write_text(SCENARIO.to_toml())
    chosen = {
        "scenario": str(tmp_path / "flock.toml"),
        "per_agent": True,
        "max_range": 30.0,
        "predator_visible": False,
        "profile_ranges": (0.0, 10.0, 30.0),
        "extra_entries": ("closest_approach", "escape_direction"),
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


def search_args(folder: Path, **changes: Any) -> SearchArgs:
    small = {"per_agent": True, "inputs": INPUTS, "hidden": (3,), "memory": 1, "generations": 2}
    args = small_run(folder, "search", **{**small, **changes})
    assert isinstance(args, SearchArgs)
    return args


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return train(search_args(tmp_path_factory.mktemp("stored") / "run"))


def test_a_search_starts_from_a_stored_policy(stored: Path, tmp_path: Path) -> None:
    args = search_args(tmp_path / "run", start=str(stored), seed=1)
    family, policy = family_of(args), load_policy(stored).policy
    zero = np.zeros((1, family.size))
    np.testing.assert_array_equal(family.policy(zero[0]).parameters, policy.parameters)
    expected = objective(args, policy, SEEDS)
    np.testing.assert_array_equal(family.play(args, zero, SEEDS)[0][0], expected)

    continued = load_policy(train(args)).policy
    curve = pl.read_parquet(args.run / CURVE_FILE)
    tuning = first_seeds(TUNING, CURVE_FLOCKS)
    assert curve["episodes"][0] == 0
    assert curve["objective"][0] == objective(args, policy, tuning).mean()
    assert curve["objective"].max() == objective(args, continued, tuning).mean()


PROFILE: dict[str, Any] = {
    "profile_ranges": (0.0, 5.0, 10.0, 30.0),
    "extra_entries": ("escape_direction",),
    "max_range": 30.0,
    "memory": 0,
}


@pytest.mark.parametrize("hidden", [(), (3,), (4, 2)])
def test_a_search_starts_from_a_rule(hidden: tuple[int, ...], tmp_path: Path) -> None:
    seen = {"candidate_inputs": ("neighbor_count", "escape_cosine", "range"), "hidden": hidden}
    args = search_args(tmp_path / "run", start="turn-away", **PROFILE, **seen)
    family = family_of(args)
    rule = objective(args, BestCandidate("escape_cosine"), SEEDS)
    np.testing.assert_array_equal(family.play(args, np.zeros((1, family.size)), SEEDS)[0][0], rule)


def test_a_search_of_a_rule_begins_with_parameters_chosen_by_hand(tmp_path: Path) -> None:
    own = {"extra_entries": ("closest_approach",), "steps_per_action": 1, "max_range": 100.0}
    args = search_args(tmp_path / "run", rule="win-stay-lose-shift", step_size=1e-12, **own)
    found = load_policy(train(args)).policy
    assert isinstance(found, WinStayLoseShift)
    np.testing.assert_allclose(found.parameters, WinStayLoseShift().parameters)
    assert pl.read_parquet(args.run / CURVE_FILE)["episodes"][0] == 0


def test_a_restart_draws_from_the_first_distribution_on_new_flocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[tuple[NDArray[np.float64], list[int]]] = []

    class Recorded(Networks):
        def play(
            self, setting: Setting, vectors: NDArray[np.float64], seeds: Sequence[int]
        ) -> tuple[NDArray[np.float64], int]:
            drawn.append((vectors, list(seeds)))
            return super().play(setting, vectors, seeds)

    args = small_run(tmp_path / "run", "search", generations=6, restarts=2, final_flocks=8)
    assert isinstance(args, SearchArgs)
    family = family_of(args)
    assert isinstance(family, Networks)
    monkeypatch.setattr(search, "family_of", lambda _: Recorded(family.architecture))
    train(args)
    fresh = CMA(np.zeros(family.size), args.step_size, population_size=args.population, seed=args.seed)
    fresh.reseed_rng(int(np.random.SeedSequence([args.seed, 3]).generate_state(1)[0]))
    np.testing.assert_array_equal(drawn[3][0], [fresh.ask() for _ in range(args.population)])
    assert [len(flocks) for _, flocks in drawn] == [2, 3, 5] * 2
    flocks = [flock for _, flocks in drawn for flock in flocks]
    assert len(set(flocks)) == len(flocks)
