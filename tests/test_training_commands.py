"""`python -m training`: seeds never meet, a run can be trained, evaluated and compared, records are whole."""

import dataclasses
import json
from itertools import combinations
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from flockesc_env import FlockScenario, episode_seed, rollout, stats, sweep
from flockesc_env.policies import FixedRange
from training import seeds
from training.compare import CompareArgs, compare
from training.config import RunRecord, TrainArgs, presets
from training.evaluate import EvaluateArgs, evaluate
from training.train import train

SMALL = FlockScenario(num_agents=12, num_steps=24, initial_side=20.0)


def small_run(folder: Path, **changes: object) -> TrainArgs:
    args = TrainArgs(
        run=folder,
        reward="own_distance_change",
        num_flocks=2,
        num_episodes=2,
        batch_size=48,
        checkpoint_every=1,
        progress=False,
    )
    return dataclasses.replace(args, **changes)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "small"
    train(small_run(folder), SMALL)
    return folder


def test_seed_ranges_are_disjoint_and_out_of_reach_of_drawn_seeds() -> None:
    ranges = [seeds.TUNING, seeds.HELD_OUT, seeds.TRAINING]
    for one, other in combinations(ranges, 2):
        assert one.stop <= other.start or other.stop <= one.start
    assert max(r.stop for r in ranges) <= 2**32
    assert all(episode_seed(0, episode) >= 2**32 for episode in range(1, 1000))


def test_training_seeds_stay_in_their_range() -> None:
    assert seeds.training_seed(0, 4) in seeds.TRAINING
    assert seeds.training_seed(1, 4) - seeds.training_seed(0, 4) >= 4
    for seed, flocks in ((-1, 4), (1000, 4), (0, 0), (0, 1001)):
        with pytest.raises(ValueError, match="expected"):
            seeds.training_seed(seed, flocks)
    with pytest.raises(ValueError, match="flocks: expected"):
        seeds.first_seeds(seeds.HELD_OUT, 0)


def test_a_run_leaves_model_checkpoints_logs_and_record(run: Path) -> None:
    assert (run / "model.zip").is_file()
    assert len(list((run / "checkpoints").glob("*.zip"))) == 2
    assert list((run / "tensorboard").rglob("events*"))
    record = RunRecord.read(run)
    assert record.args == small_run(run)
    assert record.scenario == SMALL
    assert {"python", "torch", "flockesc-env", "stable-baselines3"} <= record.versions.keys()
    assert str(run.parent) not in (run / "config.json").read_text()


def test_a_run_is_not_overwritten(run: Path) -> None:
    with pytest.raises(FileExistsError, match="run: expected"):
        train(small_run(run), SMALL)


def test_equal_seeds_train_equal_policies(run: Path, tmp_path: Path) -> None:
    train(small_run(tmp_path / "again"), SMALL)
    train(small_run(tmp_path / "other", seed=1), SMALL)
    results = [
        evaluate(EvaluateArgs(policy=str(folder), flocks=4))["min_mean_distance"].to_list()
        for folder in (run, tmp_path / "again", tmp_path / "other")
    ]
    assert results[0] == results[1]
    assert results[0] != results[2]


def test_comparison_is_what_its_parts_say(run: Path, tmp_path: Path) -> None:
    args = CompareArgs(
        policies=("fixed:3", "random", "stubborn-leaders", str(run)),
        output=tmp_path / "comparison",
        flocks=6,
        tuning_flocks=5,
        max_range=20.0,
        grid_size=5,
    )
    table = compare(args)
    held_out = range(2_000_000, 2_000_006)
    best = sweep(SMALL, np.linspace(0, 20, 5), range(1_000_000, 1_000_005)).best_range("mean")
    fixed = rollout(FixedRange(best), held_out, scenario=SMALL).min_mean_distance
    three = rollout(FixedRange(3), held_out, scenario=SMALL).min_mean_distance
    rows = {row["policy"]: row for row in table.iter_rows(named=True)}
    assert table["policy"][0] == f"best fixed range ({best:g} m)"
    assert rows[table["policy"][0]]["objective"] == pytest.approx(fixed.mean(), abs=1e-12)
    assert rows["fixed:3"]["difference"] == pytest.approx((three - fixed).mean(), abs=1e-12)
    chance = ((three > fixed) + 0.5 * (three == fixed)).mean()
    assert rows["fixed:3"]["improvement"] == pytest.approx(chance, abs=1e-12)
    assert rows["hindsight oracle over fixed ranges"]["difference"] >= 0
    for row in rows.values():
        assert row["difference_low"] <= row["difference"] <= row["difference_high"]

    episodes = pl.read_parquet(args.output / "episodes.parquet")
    assert sorted(set(episodes["seed"])) == list(held_out)
    mine = episodes.filter(pl.col("policy") == "fixed:3").sort("seed")["objective"].to_numpy()
    np.testing.assert_array_equal(mine, three)
    assert json.loads((args.output / "comparison.json").read_text())["args"]["flocks"] == 6
    assert f"{rows['fixed:3']['objective']:.2f}" in (args.output / "table.md").read_text()
    for name in ("objective_against_range", "flock_over_time", "flock_under_attack"):
        for suffix in (".png", ".svg"):
            assert (args.output / name).with_suffix(suffix).stat().st_size > 5_000


def test_unknown_policies_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"policies: expected .* got 'nobody'"):
        compare(CompareArgs(policies=("nobody",), output=tmp_path / "none"))
    assert not (tmp_path / "none").exists()


def test_presets_are_valid() -> None:
    assert {"demo", "shared", "per-agent-visible", "per-agent-local"} <= presets().keys()
    for args in presets().values():
        args.env_options()


def test_bootstrap_interval_covers_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    covered = sum(
        interval.low <= 3.0 <= interval.high
        for interval in (stats.mean(rng.normal(3.0, 2.0, 60)) for _ in range(200))
    )
    assert 180 <= covered <= 199  # 95 % of 200, give or take three standard errors
