"""An unfinished run is continued only with its own arguments; tests/slow/test_killed_runs.py kills runs."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from small_runs import small_run

from flockesc_env import RecordError
from training import search
from training.config import Args
from training.outputs import CHECKPOINT
from training.record import CONFIG_FILE, RunRecord
from training.train import train


@pytest.fixture
def unfinished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Args:
    """Return the arguments of a run that was stopped after its last checkpoint."""

    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    args = small_run(tmp_path / "run", "search")
    with monkeypatch.context() as patch:
        patch.setattr(search, "finish", stop)
        with pytest.raises(KeyboardInterrupt):
            train(args)
    return args


def test_a_run_without_its_record_continues_only_with_its_own_arguments(unfinished: Args) -> None:
    (unfinished.run / CONFIG_FILE).unlink()
    with pytest.raises(RecordError, match=r"checkpoint\.pickle: .*delete the folder to start the run"):
        train(dataclasses.replace(unfinished, seed=1))
    assert [file.name for file in unfinished.run.iterdir()] == [CHECKPOINT]
    train(unfinished)
    assert RunRecord.read(unfinished.run).args == unfinished


@pytest.mark.parametrize(
    "damage",
    [
        lambda whole: b"",
        lambda whole: whole[: len(whole) // 2],
        lambda whole: bytes(len(whole)),
        lambda whole: whole[:400] + bytes([whole[400] ^ 1]) + whole[401:],
    ],
    ids=["empty", "truncated", "zeros", "a flipped bit"],
)
def test_a_damaged_checkpoint_is_named(unfinished: Args, damage: Any) -> None:
    path = unfinished.run / CHECKPOINT
    path.write_bytes(damage(path.read_bytes()))
    before = path.read_bytes()
    with pytest.raises(RecordError, match="a damaged one, or another run's") as caught:
        train(unfinished)
    assert caught.value.field == str(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("content", ["", "{", "[]", '{"learner": "search"}'])
def test_a_damaged_record_is_named(unfinished: Args, content: str) -> None:
    path = unfinished.run / CONFIG_FILE
    path.write_text(content)
    with pytest.raises(RecordError, match="expected the record of a run") as caught:
        train(unfinished)
    assert caught.value.field == str(path)


def test_a_checkpoint_that_cannot_be_written_is_found_before_the_first_round(
    unfinished: Args, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: Any) -> None:
        raise AssertionError("trained before the folder was checked")

    (unfinished.run / CHECKPOINT).unlink()
    (unfinished.run / CHECKPOINT).mkdir()
    monkeypatch.setattr(search, "_generation", never)
    with pytest.raises(IsADirectoryError, match=CHECKPOINT):
        train(unfinished)


def test_an_unfinished_run_is_not_continued_with_other_arguments(
    unfinished: Args,
) -> None:
    before = (unfinished.run / CHECKPOINT).read_bytes()
    with pytest.raises(FileExistsError, match=r"run: expected the arguments and versions of .*, got others"):
        train(dataclasses.replace(unfinished, seed=1))
    assert (unfinished.run / CHECKPOINT).read_bytes() == before
