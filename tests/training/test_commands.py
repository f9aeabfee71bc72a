"""`python -m training`: disjoint seeds; runs are trained, evaluated, compared and recorded."""

import dataclasses
import json
import shlex
import subprocess
import sys
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from small_runs import SMALL, small_run
from stable_baselines3 import A2C
from training.config import PPOArgs, SB3Args
from training.evaluation import objective, policy_spec
from training.policies import named_policy
from training.presets import presets
from training.record import RunRecord

import flockesc_env as fe
from flockesc_env.cli import main
from flockesc_env.episodes import splits
from flockesc_env.policies import FixedRange, load_policy
from flockesc_env.policies.registry import NamedPolicy
from flockesc_env.sb3 import AgentVecEnv
from training.__main__ import TRAINING
from training.compare import CompareArgs, compare
from training.rounds import LINE_ACTIONS
from training.train import train


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "small"
    train(small_run(folder))
    return folder


def three() -> NamedPolicy:
    return NamedPolicy("my three", FixedRange(3))


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


def test_a_run_leaves_policy_curve_speed_and_record(run: Path) -> None:
    files = {file.name for file in run.iterdir()}
    assert files == {"checkpoint.pickle", "config.json", "curve.parquet", "policy.npz", "run.json"}
    record = RunRecord.read(run)
    assert record.args == small_run(run)
    assert {"python", "torch", "flockesc-env", "stable-baselines3", "sb3-contrib"} <= record.versions.keys()
    assert named_policy(str(run)).scenario == SMALL


def test_a_run_is_not_overwritten(run: Path) -> None:
    with pytest.raises(fe.ArgumentError, match="run: expected"):
        train(small_run(run))


def test_comparison_follows_from_its_records(run: Path, tmp_path: Path) -> None:
    args = CompareArgs(
        policies=("fixed:3", "random", "stubborn-leaders", f"{__name__}:three", str(run)),
        output=tmp_path / "comparison",
        flocks=6,
        tuning_flocks=5,
        max_range=20.0,
        grid_size=3,
    )
    table = compare(args)
    held_out = range(2_000_000, 2_000_006)
    tuning = range(1_000_000, 1_000_005)
    near = fe.sweep(SMALL, [0, 10, 20], tuning).best_range("mean")
    finer = {0: np.arange(0, 9, 2), 10: np.arange(2, 19, 2), 20: np.arange(12, 21, 2)}
    best = fe.sweep(SMALL, finer[near], tuning).best_range("mean")
    fixed = fe.rollout(SMALL, FixedRange(best), held_out).min_mean_distance
    three = fe.rollout(SMALL, FixedRange(3), held_out).min_mean_distance
    rows = {row["policy"]: row for row in table.iter_rows(named=True)}
    assert table["policy"][0] == f"best fixed range ({best:g} m)"
    assert rows[table["policy"][0]]["objective"] == pytest.approx(fixed.mean(), abs=1e-12)
    assert rows["fixed:3"]["difference"] == pytest.approx((three - fixed).mean(), abs=1e-12)
    chance = ((three > fixed) + 0.5 * (three == fixed)).mean()
    assert rows["my three"]["objective"] == rows["fixed:3"]["objective"]
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


@pytest.mark.parametrize("name", presets())
def test_presets_are_valid(name: str) -> None:
    preset = presets()[name]
    setting = preset.setting
    assert preset.learners
    for learner, entry in preset.learners.items():
        args: Any = entry.args
        # Learners may choose the largest range of an action, how long it holds, and entries about the closest
        # approach, which an agent could compute from its other entries.
        own: dict[str, Any] = {"max_range": args.max_range, "steps_per_action": args.steps_per_action}
        if args.extra_entries == ("closest_approach",):
            own["extra_entries"] = args.extra_entries
        assert args.setting() == dataclasses.replace(setting, **own)
        assert args.run == Path("runs") / f"{name}-{learner}"
        seen = policy_spec(args)
        assert seen.num_agents == args.model.num_agents
        assert {*getattr(args, "inputs", ())} <= {*seen.layout.names}
        flocks = args.num_flocks if isinstance(args, SB3Args) else getattr(args, "final_flocks", args.flocks)
        last = max(entry.seeds - 1, 0)
        assert len(splits.training_seeds(last, 0, flocks * getattr(args, args.budget))) > 0
        if isinstance(args, SB3Args):
            options = {**args.env_options(), "reward": args.reward}
            make: Any = fe.parallel_env if setting.per_agent else fe.FlockEscapeEnv
            (fe.LineEscapeEnv if setting.is_line else make)(args.model, **options)  # checks the options
            assert isinstance(args, PPOArgs) or not setting.per_agent
        if isinstance(args, PPOArgs):
            steps, rows = LINE_ACTIONS, seen.num_agents if setting.per_agent else 1
            if isinstance(args.model, fe.FlockScenario):
                steps = -(-(args.episode_steps or args.model.num_steps) // args.steps_per_action)
            assert steps * args.num_flocks * rows % args.batch_size == 0


def test_commands_train_evaluate_and_compare(tmp_path: Path) -> None:
    args, out, evaluated = small_run(tmp_path / "run"), tmp_path / "out", tmp_path / "e"
    few = "--num-flocks 2 --num-episodes 2 --net-arch 8 --seed 3 --no-progress"
    for command in (
        f"train per-agent-visible-ppo --run {args.run} --scenario {args.scenario} {few}",
        f"evaluate --policy {args.run} --flocks 3 --output {evaluated}",
        f"compare --policies {args.run} --flocks 3 --output {out} --tuning-flocks 2 --grid-size 3",
    ):
        assert TRAINING.main(command.split()) == 0
    trained = RunRecord.read(args.run).args
    assert isinstance(trained, PPOArgs)
    assert (trained.reward, trained.seed, trained.net_arch) == ("individual_running_minimum", 3, (8,))
    alone = pl.read_parquet(evaluated)["min_mean_distance"]
    beside = pl.read_parquet(out / "episodes.parquet").filter(policy="run")["objective"]
    assert alone.to_list() == beside.to_list()


def test_a_model_of_stable_baselines3_plays_with_the_options_of_its_task(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    task, file = tasks["per-agent-visible"], tmp_path / "model.zip"
    model = A2C("MlpPolicy", AgentVecEnv(1, task.scenario, **task.options), device="cpu", seed=0)
    model.save(file)
    compared, evaluated = tmp_path / "compared", tmp_path / "evaluated.parquet"
    for command in (
        f"evaluate --policy A2C:{file} --flocks 2 --output {evaluated}",
        f"compare --policies A2C:{file} --flocks 2 --output {compared} --tuning-flocks 2 --grid-size 2",
    ):
        assert TRAINING.main(command.split()) == 2
        assert "in commands with --task a model with the task of its training, got" in capsys.readouterr().err
        assert TRAINING.main([*command.split(), "--task", task.name]) == 0
    assert (
        str(file) not in capsys.readouterr().out.splitlines()[-1]
    )  # `flockesc watch` shows the recorded run
    expected = fe.rollout(task.scenario, fe.SB3Policy(model), splits.HELD_OUT[:2], **task.options)
    objectives = pl.read_parquet(compared / "episodes.parquet").filter(policy="model")["objective"]
    assert objectives.to_list() == expected.min_mean_distance.tolist()
    assert pl.read_parquet(evaluated)["min_mean_distance"].to_list() == objectives.to_list()


@pytest.mark.parametrize("is_default", [True, False])
def test_a_comparison_ends_with_the_command_that_shows_it(
    is_default: bool, run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    policy, page = "fixed:5" if is_default else str(run), tmp_path / "page.html"
    few = f"--flocks 2 --tuning-flocks 2 --grid-size 2 --output {tmp_path / 'out'}"
    assert TRAINING.main(f"compare --policies {policy} {few}".split()) == 0
    program, *words = shlex.split(capsys.readouterr().out.splitlines()[-1])
    assert Path(program).is_file()
    assert main([*words, "--output", str(page)]) == 0
    assert page.is_file()


def test_the_bar_shows_the_mean_objective_of_the_last_round(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nearly_deterministic = {"learning_rate": 0.0, "log_std_init": -20.0}
    args = small_run(tmp_path / "run", progress=True, num_episodes=1, **nearly_deterministic)
    policy = load_policy(train(args)).policy
    value = objective(args, policy, splits.training_seeds(args.seed, 0, 2)).mean()
    assert f"J_mean {value:.1f} m" in capsys.readouterr().err


def test_the_help_of_train_fits_a_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert TRAINING.main(["train", "--help"]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 80


def test_the_command_line_starts_without_the_learners() -> None:
    script = "import training.__main__, sys; print(*sys.modules)"
    command = [sys.executable, "-c", script]
    run = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    loaded = set(run.stdout.split())
    assert "training.config" in loaded
    assert not loaded & {"torch", "stable_baselines3", "matplotlib", "polars", "cmaes"}


@pytest.mark.parametrize(
    "command", ["evaluate --policy fixed:5 --output table.md", "compare --policies fixed:5 --output ."]
)
def test_an_output_that_cannot_be_written_is_found_before_the_work(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("computed before the output was checked")

    monkeypatch.setattr("training.evaluate.run_policy", never)
    monkeypatch.setattr("training.compare.sweep", never)
    monkeypatch.chdir(tmp_path)
    Path("table.md").mkdir()
    assert TRAINING.main(command.split()) == 2
    assert capsys.readouterr().err == "flockesc: error: table.md: Is a directory\n"
