"""The arms race: predators, training runs, the pairing of the cross-play, files of a second call."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from option_table import small_flock
from small_runs import small_run

from flockesc_env import rollout
from flockesc_env.common import stats
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.predators import PredatorPolicySpec
from flockesc_env.jobs import find_backend
from flockesc_env.policies import find_policy
from flockesc_env.policies.predators import Pursue
from studies.arms_race import evolve
from studies.arms_race.evolve import Budget, train_flock, train_predator
from studies.arms_race.page import write_race_page
from studies.arms_race.players import SIZE, Flock, NetworkPredator, Predator
from studies.arms_race.race import BEST_FIXED, CROSS_PLAY_FILE, PER_AGENT, SETTINGS, RaceArgs, arms_race
from studies.arms_race.results import load_race
from training.config import SearchArgs
from training.record import CURVE_FILE
from training.search import search

SCENARIO = small_flock(num_agents=6, num_steps=24, initial_side=60.0).with_learned_predators()
BUDGET = Budget(population=4, generations=2, flocks=2, final_flocks=2, check_every=1, tuning_flocks=3)
SEEDS = [3, 4, 5]


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evolve, "SCENARIO", SCENARIO)


@pytest.fixture(scope="module")
def learned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of studies with what the race reads of them."""
    folder = tmp_path_factory.mktemp("learned")
    for setting in SETTINGS.values():
        study = folder / setting
        (study / "policies").mkdir(parents=True)
        args = small_run(study / "run", "search", per_agent=setting != "shared")
        assert isinstance(args, SearchArgs)
        policy = search(args)

        shutil.copy(policy, study / "policies" / "search-0.npz")
        curve = pl.read_parquet(args.run / CURVE_FILE)
        origin = pl.lit("search").alias("learner"), pl.lit(0).alias("training_seed")
        curve.with_columns(*origin).write_parquet(study / "curves.parquet")
        (study / "study.json").write_text(json.dumps({"best_fixed_range": 10.0}))
    return folder


def played(flock: str, predator: Any) -> FloatArray:
    return rollout(
        SCENARIO, flock, SEEDS, predator_policy=predator, steps_per_action=evolve.STEPS_PER_ACTION
    ).min_mean_distance


def test_parameters_of_0_pursue_the_centroid() -> None:
    network = played("fixed:10", NetworkPredator(np.zeros(SIZE)))
    np.testing.assert_array_equal(network, played("fixed:10", Pursue("centroid")))


def test_a_predator_treats_left_and_right_alike() -> None:
    spec, rng = PredatorPolicySpec.of(SCENARIO), np.random.default_rng(0)
    observations = rng.uniform(-1, 1, (20, len(spec.layout.names))).astype(np.float32)
    reflected = observations.copy()
    reflected[:, [name.endswith("_left") for name in spec.layout.names]] *= -1
    predator = NetworkPredator(0.2 * rng.normal(size=SIZE))
    expected = predator.act(observations, spec) * [1, -1]
    np.testing.assert_array_equal(predator.act(reflected, spec), expected)
    assert np.unique(expected).size > 20


def test_the_search_finds_the_maximum_of_a_parabola() -> None:
    target = np.array([0.3, -0.2, 0.1])

    def value(vectors: FloatArray, flocks: range) -> FloatArray:
        heights = -((vectors - target) ** 2).sum(axis=1)
        return np.repeat(heights[:, None], len(flocks), axis=1)

    budget = Budget(population=8, generations=40, check_every=10, tuning_flocks=2)
    found = evolve.evolve(value, 3, 0.3, budget, seed=0)
    np.testing.assert_allclose(found["parameters"], target, atol=1e-3)
    assert found["episodes"] == budget.episodes


@pytest.mark.parametrize("flock", ["fixed:10", "learned"])
def test_a_generation_of_predators_plays_as_each_does_alone(
    flock: str, learned: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = str(learned / SETTINGS[PER_AGENT] / "policies" / "search-0.npz") if flock == "learned" else flock
    seen: list[FloatArray] = []

    def watched(value: evolve.Play, size: int, *_: Any) -> dict[str, Any]:
        vectors = np.random.default_rng(1).normal(size=(3, size))
        seen.append(value(vectors, range(3, 6)))
        seen.append(np.array([-played(spec, NetworkPredator(vector)) for vector in vectors]))
        return {"parameters": vectors[0], "curve": np.zeros(1)}

    monkeypatch.setattr(evolve, "evolve", watched)
    monkeypatch.setattr(evolve, "BATCH", 6)  # groups of two vectors and one
    train_predator(Flock(spec), (0.0,) * SIZE, BUDGET, 100)
    together, alone = seen
    np.testing.assert_array_equal(together, alone)
    assert len(set(alone.ravel().round(6))) > 3


def test_training_begins_with_the_stored_policy_and_never_ends_below_it(learned: Path) -> None:
    start = Flock(str(learned / SETTINGS[PER_AGENT] / "policies" / "search-0.npz"))
    predator = Predator("nearest")
    result = train_flock(start, predator, BUDGET, 100)
    tuning = range(1_000_000, 1_000_003)
    before = evolve.play(start, predator, tuning)["objective"].mean()
    after = evolve.play(Flock(start.spec, tuple(result["parameters"])), predator, tuning)["objective"].mean()
    assert result["curve"][0] == before
    assert result["curve"].max() == after


def test_the_race_is_paired_and_a_second_call_repeats_it(learned: Path, tmp_path: Path) -> None:
    args = RaceArgs(tmp_path / "race", learned, rounds=1, num_flocks=4, budget=BUDGET)
    race = arms_race(args, find_backend("serial"))
    table = pl.read_parquet(args.output / CROSS_PLAY_FILE)
    names = [BEST_FIXED, "stubborn leaders", "shared", "per agent", "per agent, round 1", "shared, round 1"]
    assert list(race.flocks) == names
    assert list(race.predators) == ["straight", "nearest", "centroid", *names]
    flocks = list(range(2_000_000, 2_000_004))
    for _, rows in table.group_by("flock_policy", "predator"):
        assert rows["seed"].to_list() == flocks
    assert table.height == len(race.flocks) * len(race.predators) * len(flocks)

    results = load_race(args.output)
    straight = rollout(SCENARIO, "fixed:10", flocks, steps_per_action=4).min_mean_distance
    np.testing.assert_array_equal(results.objective[BEST_FIXED, "straight"], straight)
    own = results.objective[BEST_FIXED, BEST_FIXED]
    assert results.loss(BEST_FIXED) == stats.mean(straight - own)
    stored = find_policy(str(args.output / "policies" / "per-agent-round-1.npz"))
    replayed = rollout(SCENARIO, stored, flocks, predator_policy=Pursue("centroid")).min_mean_distance
    np.testing.assert_array_equal(results.objective["per agent, round 1", "centroid"], replayed)

    write_race_page(args.output, tmp_path / "page.md")
    files = [*args.output.glob("*.*"), *args.output.glob("policies/*"), tmp_path / "page.md"]
    before = {file: file.read_bytes() for file in files}
    arms_race(args, find_backend("serial"))
    write_race_page(args.output, tmp_path / "page.md")
    assert {file: file.read_bytes() for file in files} == before
