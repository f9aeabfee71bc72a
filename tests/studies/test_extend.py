"""``python -m training extend``: a finished run continued equals a run that was long from the start."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from small_runs import small_run

from training.__main__ import TRAINING
from training.arguments import ExtendArgs
from training.config import Args
from training.extend import extend
from training.outputs import save_checkpoint
from training.record import CURVE_FILE, POLICY_FILE, RunRecord
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
    args = dataclasses.replace(args, **{args.budget: total})
    train(args)
    return args


@pytest.mark.parametrize("learner", UNSCHEDULED)
def test_a_continued_run_equals_a_long_run(tmp_path: Path, learner: str) -> None:
    (tmp_path / "at once").mkdir()
    long = trained(tmp_path / "at once" / "run-7", learner, LONG, **UNSCHEDULED[learner])
    short = trained(tmp_path / "run", learner, SHORT, **UNSCHEDULED[learner])
    before = {file: file.read_bytes() for file in short.run.iterdir()}
    policy = extend(ExtendArgs(run=short.run, total=LONG, progress=False))
    assert policy == tmp_path / "run-7" / POLICY_FILE
    assert policy.read_bytes() == (long.run / POLICY_FILE).read_bytes()
    curves = [pl.read_parquet(run / CURVE_FILE).drop("seconds") for run in (policy.parent, long.run)]
    assert curves[0].equals(curves[1])
    record = RunRecord.read(policy.parent)
    assert dataclasses.replace(record.args, run=long.run, scenario=long.scenario) == long
    assert record.continued_at == ()
    assert {file: file.read_bytes() for file in short.run.iterdir()} == before


@pytest.mark.parametrize(
    ("learner", "field", "changes"),
    [("search", "final_flocks", {"final_flocks": 8}), ("shared PPO", "anneal", {})],
)
def test_a_schedule_over_the_whole_run_is_named(
    tmp_path: Path, learner: str, field: str, changes: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    """The rounds after the finished run follow the schedule of the longer run."""
    (tmp_path / "long").mkdir()
    long = trained(tmp_path / "long" / "on", learner, LONG, **changes)
    short = trained(tmp_path / "run", learner, SHORT, **changes)
    TRAINING.main(["extend", str(short.run), str(LONG), "--output", str(tmp_path / "on"), "--no-progress"])
    assert re.search(rf"differs .* schedule of {field} changed at {SHORT}", capsys.readouterr().out)
    assert RunRecord.read(tmp_path / "on").continued_at == (SHORT,)
    assert (tmp_path / "on" / POLICY_FILE).read_bytes() != (long.run / POLICY_FILE).read_bytes()
    further = extend(ExtendArgs(run=tmp_path / "on", total=LONG + 1, progress=False))
    assert RunRecord.read(further.parent).continued_at == (SHORT, LONG)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return trained(tmp_path_factory.mktemp("runs") / "run", "search", SHORT).run


def test_an_interrupted_extension_continues(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is interrupted after its first own checkpoint."""

    def save_and_stop(record: RunRecord, state: Any) -> None:
        save_checkpoint(record, state)
        raise KeyboardInterrupt

    given = ExtendArgs(run=finished, total=LONG, output=tmp_path / "once" / "run", progress=False)
    expected = extend(given).read_bytes()
    again = dataclasses.replace(given, output=tmp_path / "again" / "run")
    with monkeypatch.context() as patch:
        patch.setattr("training.train.save_checkpoint", save_and_stop)
        with pytest.raises(KeyboardInterrupt):
            extend(again)
    assert not (tmp_path / "again" / "run" / POLICY_FILE).exists()
    assert extend(again).read_bytes() == expected
