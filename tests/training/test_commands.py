"""`python -m training`, `flockesc compare`: seeds, trained policies beside the best fixed range."""

import json
import shlex
from itertools import combinations
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from cli_runs import Cli
from small_runs import SMALL, small_run, small_task
from stable_baselines3 import A2C, PPO

import flockesc_env as fe
from flockesc_env.cli import main
from flockesc_env.episodes import splits
from flockesc_env.policies import FixedRange, SB3Policy, load_policy
from flockesc_env.policies.comparison import ORACLE
from flockesc_env.sb3 import RangePolicy
from flockesc_env.taskset import tasks
from training.__main__ import TRAINING
from training.figures import draw
from training.train import train

HELD_OUT = splits.HELD_OUT[:6]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "small"
    train(small_run(folder))
    return folder


def test_seed_ranges_are_disjoint_and_out_of_reach_of_drawn_seeds() -> None:
    ranges = [splits.TUNING, splits.HELD_OUT, splits.TRAINING]
    for one, other in combinations(ranges, 2):
        assert one.stop <= other.start or other.stop <= one.start
    assert max(r.stop for r in ranges) <= 2**32
    assert all(fe.episode_seed(0, episode) >= 2**32 for episode in range(1, 1000))


def test_training_seeds_stay_in_their_range() -> None:
    first, second = splits.training_seeds(0, 0, 4), splits.training_seeds(0, 4, 4)
    assert first.stop == second.start
    assert splits.training_seeds(0, 999_996, 4).stop == splits.training_seeds(1, 0, 1).start
    assert splits.training_seeds(999, 999_996, 4).stop == splits.TRAINING.stop
    for bad in ((-1, 0, 4), (1000, 0, 4), (0, 0, 0), (0, -1, 4), (0, 999_997, 4)):
        with pytest.raises(ValueError, match="expected"):
            splits.training_seeds(*bad)
    with pytest.raises(ValueError, match="flocks: expected"):
        splits.first_seeds(splits.HELD_OUT, 0)


def test_a_comparison_is_that_of_rollouts_and_sweeps(run: Path) -> None:
    task = small_task()
    model = A2C("MlpPolicy", task.vec_env(1), device="cpu", seed=0)
    found = task.compare("fixed:3", FixedRange(3), str(run / "policy.npz"), model, num_flocks=6)
    fixed, oracle, rule, three, same, learned, untrained = found.values.values()
    best = task.scales["small"].best_fixed_range
    assert list(found.values)[:2] == [f"best fixed range ({best:g} m)", ORACLE]
    np.testing.assert_array_equal(fixed, fe.rollout(SMALL, FixedRange(best), HELD_OUT).min_mean_distance)
    np.testing.assert_array_equal(oracle, fe.sweep(SMALL, SMALL.search_ranges, HELD_OUT).hindsight_oracle())
    leaders = fe.rollout(SMALL, task.rule, HELD_OUT, **task.options)
    np.testing.assert_array_equal(rule, leaders.min_mean_distance)
    np.testing.assert_array_equal(three, same)
    entry = load_policy(run / "policy.npz")
    np.testing.assert_array_equal(learned, fe.rollout(SMALL, entry, HELD_OUT).min_mean_distance)
    played = fe.rollout(SMALL, SB3Policy(model), HELD_OUT, **task.options)
    np.testing.assert_array_equal(untrained, played.min_mean_distance)

    row = found.rows["fixed:3"]
    assert row.difference.mean == pytest.approx((three - fixed).mean(), abs=1e-12)
    chance = ((three > fixed) + 0.5 * (three == fixed)).mean()
    assert row.improvement.mean == pytest.approx(chance, abs=1e-12)
    assert row.difference.low <= row.difference.mean <= row.difference.high
    line = next(line for line in str(found).splitlines() if line.startswith("| fixed:3 |"))
    assert f"{row.objective:.2f} | {row.difference:.2f}" in line
    table = found.table().filter(policy="fixed:3").sort("seed")
    assert (table["seed"].to_list(), table["objective"].to_list()) == (list(HELD_OUT), three.tolist())
    with pytest.raises(fe.InputError, match="turn-away: profile_ranges: expected none, as in the task"):
        task.compare("turn-away")
    with pytest.raises(fe.InputError, match="num_flocks: expected an integer from 1 to 1000"):
        task.compare(num_flocks=1001)


def test_the_command_compares_models_and_files(run: Path, tmp_path: Path, cli: Cli) -> None:
    task, file = tasks["per-agent-visible"], tmp_path / "model.zip"
    model = A2C("MlpPolicy", task.vec_env(1), device="cpu", seed=0)
    model.save(file)
    few = ("--task", task.name, "--flocks", 2)
    ran = cli("compare", f"A2C:{file}", str(run), *few, "--output", tmp_path / "out")
    table = pl.read_parquet(tmp_path / "out/episodes.parquet")
    expected = fe.rollout(task.scenario, SB3Policy(model), HELD_OUT[:2], **task.options)
    assert table.filter(policy="model")["objective"].to_list() == expected.min_mean_distance.tolist()
    assert ran.out.startswith((tmp_path / "out/table.md").read_text())
    refused = cli("watch", f"A2C:{file}")
    assert (refused.code, refused.out) == (2, "")
    assert "policy: expected a model that knows its scenario and options: one of RangePolicy" in refused.err
    document = cli("compare", f"A2C:{file}", *few, "--json").json()
    assert document["policies"]["model"]["objective"]["mean"] == expected.min_mean_distance.mean()
    shorter = task.vec_env(1, max_range=10.0)  # the model stores it
    settings = {"spec": shorter.get_attr("policy_spec")[0], "first_range": 10.0}
    PPO(RangePolicy, shorter, device="cpu", policy_kwargs=settings).save(file)
    assert "| model | " in cli("compare", f"PPO:{file}", *few).out


def test_figures_and_recorded_runs_follow_a_comparison(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "out"
    draw(small_task(), [load_policy(run / "policy.npz")], output, 3)
    for name in ("objective_against_range.png", "flock_under_attack.png"):
        assert (output / name).stat().st_size > 5_000
    assert {"comparison.json", "grid_search.parquet", "table.md"} <= {file.name for file in output.iterdir()}
    program, *words = shlex.split(capsys.readouterr().out.splitlines()[-1])
    assert Path(program).is_file()
    assert main([*words, "--output", str(tmp_path / "page.html")]) == 0


def test_the_commands_train_list_and_refuse(tmp_path: Path, cli: Cli) -> None:
    few = ["--learner", "schedule", "--run", str(tmp_path / "run"), "--no-progress"]
    listed = cli("learners", "per-agent-visible", run=TRAINING.main)
    assert "ppo-large-rounds" in listed.out
    bad = cli("train", "one-range", *few[:1], "ppx", *few[2:], run=TRAINING.main)
    assert (bad.code, bad.err.count("\n")) == (2, 1)
    assert "expected one of ppo, ppo-10x, search-1x, " in bad.err
    assert not (tmp_path / "run").exists()
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "mine.txt").write_text("mine")
    full = cli("train", "one-range", *few, run=TRAINING.main)
    assert "run: expected an empty folder or one of a run" in full.err
    file = ["--output", tmp_path / "run/mine.txt"]
    assert cli("figures", "fixed:5", "--task", "one-range", *file, run=TRAINING.main).code == 2


def test_a_run_leaves_its_record(run: Path) -> None:
    record = json.loads((run / "config.json").read_text())
    assert (record["task"], record["learner"], record["seed"]) == ("per-agent-visible", "ppo", 0)
    assert {"python", "torch", "flockesc-env", "stable-baselines3", "sb3-contrib"} <= record[
        "versions"
    ].keys()
    assert record["table"]["hyperparameters"]["n_steps"] == 6
