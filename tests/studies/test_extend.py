"""``python -m training extend``: a finished run continued equals a run that was long from the start."""

from __future__ import annotations

import dataclasses
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from small_runs import small_run

from flockesc_env import ArgumentError, load_policy
from training import search
from training.__main__ import main
from training.arguments import ExtendArgs
from training.config import BUDGETS, Args
from training.extend import extend
from training.outputs import CHECKPOINT, save_checkpoint
from training.record import CONFIG_FILE, CURVE_FILE, POLICY_FILE, RunRecord
from training.train import train

SHORT, LONG = 4, 7  # neither is a multiple of the rounds between two points of the learning curve
UNSCHEDULED: dict[str, dict[str, Any]] = {
    "search": {"final_flocks": 2},
    "per-agent PPO": {"anneal": False},
    "shared PPO": {"anneal": False},
    "TQC": {},
    "imitation": {},
}


def trained(folder: Path, learner: str, total: int, **changes: Any) -> Args:
    """Train a small run of this length and return its arguments."""
    args = small_run(folder, learner, checkpoint_every=3, **changes)
    args = dataclasses.replace(args, **{BUDGETS[type(args)]: total})
    train(args)
    return args


def parameters(folder: Path) -> np.ndarray:
    policy: Any = load_policy(folder / POLICY_FILE).policy
    return np.asarray(policy.parameters)


def curve(folder: Path) -> pl.DataFrame:
    return pl.read_parquet(folder / CURVE_FILE).drop("seconds")


@pytest.mark.parametrize("learner", UNSCHEDULED)
def test_a_continued_run_equals_a_long_run(tmp_path: Path, learner: str) -> None:
    (tmp_path / "at once").mkdir()
    long = trained(tmp_path / "at once" / "run-7", learner, LONG, **UNSCHEDULED[learner])
    short = trained(tmp_path / "run", learner, SHORT, **UNSCHEDULED[learner])
    before = {file: file.read_bytes() for file in short.run.iterdir()}
    policy = extend(ExtendArgs(run=short.run, total=LONG, progress=False))
    assert policy == tmp_path / "run-7" / POLICY_FILE
    assert policy.read_bytes() == (long.run / POLICY_FILE).read_bytes()
    assert curve(policy.parent).equals(curve(long.run))
    record = RunRecord.read(policy.parent)
    assert dataclasses.replace(record.args, run=long.run, scenario=long.scenario) == long
    assert record.continued_at == ()
    assert {file: file.read_bytes() for file in short.run.iterdir()} == before


@pytest.mark.parametrize(("learner", "field"), [("search", "final_flocks"), ("shared PPO", "anneal")])
def test_a_schedule_over_the_whole_run_is_named(
    tmp_path: Path,
    learner: str,
    field: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The rounds after the finished run follow the schedule of the longer run."""
    schedule = {"final_flocks": 8} if learner == "search" else {}
    long = trained(tmp_path / "long", learner, LONG, **schedule)
    short = trained(tmp_path / "run", learner, SHORT, **schedule)
    words = [
        "training",
        "extend",
        str(short.run),
        str(LONG),
        "--output",
        str(tmp_path / "on"),
        "--no-progress",
    ]
    monkeypatch.setattr(sys, "argv", words)
    assert main() == 0
    assert re.search(rf"differs .* schedule of {field} changed at {SHORT}", capsys.readouterr().out)
    assert RunRecord.read(tmp_path / "on").continued_at == (SHORT,)
    assert parameters(tmp_path / "on").tobytes() != parameters(long.run).tobytes()
    further = extend(ExtendArgs(run=tmp_path / "on", total=LONG + 1, progress=False))
    assert RunRecord.read(further.parent).continued_at == (SHORT, LONG)


def test_an_interrupted_extension_continues(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is interrupted after its first own checkpoint."""
    short = trained(tmp_path / "run", "search", SHORT)
    given = ExtendArgs(run=short.run, total=LONG, progress=False)
    expected = parameters(extend(given).parent)

    def save_and_stop(state: Any, run: Path) -> None:
        save_checkpoint(state, run)
        raise KeyboardInterrupt

    again = dataclasses.replace(given, output=tmp_path / "again")
    with monkeypatch.context() as patch:
        patch.setattr(search, "save_checkpoint", save_and_stop)
        with pytest.raises(KeyboardInterrupt):
            extend(again)
    assert not (tmp_path / "again" / POLICY_FILE).exists()
    assert parameters(extend(again).parent).tobytes() == expected.tobytes()


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return trained(tmp_path_factory.mktemp("runs") / "run", "search", SHORT).run


def edit(run: Path, name: str, value: Any) -> None:
    document = json.loads((run / CONFIG_FILE).read_text())
    document[name] |= value
    (run / CONFIG_FILE).write_text(json.dumps(document))


@pytest.mark.parametrize(
    ("spoil", "total", "field", "words"),
    [
        (lambda run: (run / CONFIG_FILE).unlink(), LONG, "run", "the folder of a run"),
        (lambda run: (run / POLICY_FILE).unlink(), LONG, "run", "a finished run"),
        (lambda run: (run / CHECKPOINT).unlink(), LONG, "run", CHECKPOINT),
        (lambda run: edit(run, "versions", {"numpy": "0"}), LONG, "run", "installed versions of numpy"),
        (lambda run: edit(run, "args", {"restarts": 2}), LONG, "run", "without restarts"),
        (lambda run: edit(run, "args", {"scenario": "pursuit"}), LONG, "run", "pursuit has not changed"),
        (lambda _: None, SHORT, "total", "more than the 4 generations"),
    ],
)
def test_runs_that_cannot_be_continued_are_refused(
    tmp_path: Path, finished: Path, spoil: Any, total: int, field: str, words: str
) -> None:
    run = tmp_path / "run"
    run.mkdir()
    for file in finished.iterdir():
        (run / file.name).write_bytes(file.read_bytes())
    spoil(run)
    with pytest.raises(ArgumentError, match=words) as caught:
        extend(ExtendArgs(run=run, total=total))
    assert caught.value.field == field
    assert [folder.name for folder in tmp_path.iterdir()] == ["run"]
