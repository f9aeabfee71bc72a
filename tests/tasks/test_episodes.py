"""Data sets of episodes: replays give the same bits, files are complete."""

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from cli_runs import Ran

from flockesc_env.cli.application import Application
from flockesc_env.cli.tasks import episodes as run
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.splits import HELD_OUT, TRAINING
from flockesc_env.policies import PolicySpec, as_policy
from flockesc_env.taskset.definition import Shortcut
from flockesc_env.taskset.episodes import environment, record_episodes
from flockesc_env.taskset.scoring import LoadedPolicy
from flockesc_env.taskset.task import tasks

GRID = (0.0, 0.1, 0.35, 1.0)


class Alternate:
    """Chooses the entries of a grid one after another; fails when episode ``fails_in`` starts."""

    def __init__(self, fails_in: int | None = None) -> None:
        self.fails_in, self.episodes, self.actions = fails_in, 0, 0

    def reset(self, rows: np.ndarray) -> None:
        if self.episodes == self.fails_in:
            raise RuntimeError("no more")
        self.episodes, self.actions = self.episodes + 1, 0

    def act(self, observations: np.ndarray, spec: PolicySpec) -> np.ndarray:
        self.actions += 1
        return np.full(len(observations), self.actions % len(GRID))


def alternate(fails_in: int | None = None) -> LoadedPolicy:
    options: Any = {"action_mode": "discrete", "range_grid": GRID, "reward": "terminal"}
    policy = as_policy(Alternate(fails_in)).with_options(name="alternate", per_agent=False, **options)
    return LoadedPolicy("module:alternate", "", policy)


def record(task: str, output: Path, *policies: str | LoadedPolicy, flocks: int = 2) -> None:
    found = [LoadedPolicy.of(each) if isinstance(each, str) else each for each in policies]
    record_episodes(found, tasks[task], TRAINING[:flocks], output)


def options(folder: Path) -> dict[str, dict[str, Any]]:
    facts = pl.read_parquet(folder / "policies.parquet")
    return {name: json.loads(text) for name, text in facts.select("policy", "options").iter_rows()}


@pytest.mark.parametrize(
    ("task", "policy"),
    [
        ("one-range", "random"),
        ("per-agent-visible", "stubborn-leaders"),
        ("per-agent-visible", "fixed:12"),
        ("line", alternate()),
    ],
)
def test_replayed_actions_give_the_recorded_bits(task: str, policy: Any, tmp_path: Path) -> None:
    record(task, tmp_path / "data", policy)
    ((name, chosen),) = options(tmp_path / "data").items()
    rows = pl.read_parquet(tmp_path / "data" / f"{name}.parquet")
    ends = pl.read_parquet(tmp_path / "data" / "episodes.parquet")
    env = environment(tasks[task], **{**chosen, "action_mode": "normalized"})
    for seed, end in zip(TRAINING, ends.iter_rows(named=True), strict=False):
        observation, _ = env.reset(seed=seed)
        steps = rows.filter(seed=seed).partition_by("step", maintain_order=True)
        for step in steps:
            np.testing.assert_array_equal(step["observation"].to_numpy(), np.atleast_2d(observation))
            action = step["action"].to_numpy()[:, np.newaxis]
            observation, *results, info = env.step(action if "agent" in step.columns else action[0])
            for column, result in zip(("reward", "terminated", "truncated"), results, strict=True):
                np.testing.assert_array_equal(step[column].to_numpy(), np.atleast_1d(result))
            np.testing.assert_array_equal(
                step["range"].to_numpy(), np.atleast_1d(info["interaction_range"]).astype(np.float32)
            )
        assert (step["terminated"] | step["truncated"]).all()
        assert end["steps"] == len(steps)
        assert end["objective"] == np.atleast_1d(info[tasks[task].spec.name])[0]
        np.testing.assert_array_equal(np.float32(end["last_observation"]), np.ravel(observation))


def test_a_policy_that_sees_less_than_the_task_allows_still_does(tmp_path: Path) -> None:
    names = ("random", "stubborn-leaders-local", "stubborn-leaders")
    record("per-agent-visible", tmp_path / "data", *names, flocks=1)
    chosen = options(tmp_path / "data")
    task = {name: value for name, value in tasks["per-agent-visible"].options.items() if value != math.inf}
    assert chosen["random"] == chosen["stubborn-leaders"] == task
    assert chosen["stubborn-leaders-local"] == {**task, "predator_sensing_range": 30.0}


def test_rows_are_in_order_over_all_parts(tmp_path: Path) -> None:
    """A part has ten lines."""
    record("line", tmp_path / "data", "random", "fixed:0.3", flocks=21)
    keys = pl.read_parquet(tmp_path / "data" / "random.parquet").select("seed", "step")
    assert keys["seed"].unique(maintain_order=True).to_list() == list(TRAINING[:21])
    assert keys.equals(keys.sort("seed", "step"))
    ends = pl.read_parquet(tmp_path / "data" / "episodes.parquet")
    assert ends["policy"].to_list() == ["random"] * 21 + ["fixed-0-3"] * 21


def test_a_run_that_ends_early_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="no more"):
        record("line", tmp_path, "random", alternate(fails_in=12), flocks=20)
    assert not any(tmp_path.iterdir())


def test_errors(tmp_path: Path) -> None:
    Path(tmp_path, "mine.txt").touch()
    data = tmp_path / "data"
    with pytest.raises(InputError, match="seeds outside of the held-out ones"):
        record_episodes([LoadedPolicy.of("random")], tasks["line"], HELD_OUT[:1], data)
    with pytest.raises(InputError, match="output: expected a new or empty folder"):
        record("line", tmp_path, "random")
    with pytest.raises(InputError, match="policies: expected different names"):
        record("line", data, "fixed:0.5", "fixed:0.5")
    with pytest.raises(InputError, match="stubborn-leaders: per_agent: expected False"):
        record("one-range", data, "stubborn-leaders")


def test_the_command_plays_the_rule_of_the_task(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rule = Shortcut(policy="fixed:0.3", score=0.0)
    task = dataclasses.replace(tasks["line"], shortcut=rule)
    monkeypatch.setattr("flockesc_env.cli.tasks.tasks", {"line": task})
    program = Application("flockesc tasks", "", {"episodes": run}).main
    flags = ("random", "rule", "--flocks", 3, "--output", tmp_path / "data")
    ran = Ran(capsys, "episodes", *flags, "--task", "line", run=program)
    assert ran.code == 0, ran.err
    ends = pl.read_parquet(tmp_path / "data" / "episodes.parquet")
    assert ends["seed"].unique(maintain_order=True).to_list() == list(TRAINING[:3])
    means = [(name, ends.filter(policy=name)["objective"].mean()) for name in ("random", "fixed-0-3")]
    shown = [line.split()[:2] for line in ran.out.splitlines()[1:]]
    assert shown == [[name, f"{mean:.3f}"] for name, mean in means]
