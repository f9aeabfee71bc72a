"""An unfinished run is continued only with its own arguments; tests/slow/test_killed_runs.py kills runs."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from small_runs import small_run
from training.config import Args
from training.outputs import CHECKPOINT
from training.record import CONFIG_FILE, RunRecord

from flockesc_env import ArgumentError, RecordError
from training.search import SearchRounds
from training.train import train


def stop(*_: Any) -> None:
    raise KeyboardInterrupt


@pytest.fixture
def unfinished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Args:
    """Return the arguments of a run that was stopped after its last checkpoint."""
    args = small_run(tmp_path / "run", "search")
    with monkeypatch.context() as patch:
        patch.setattr("training.train.finish", stop)
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
    ("name", "damage", "message"),
    [
        *[
            (CHECKPOINT, damage, "a damaged one, or another run's")
            for damage in (
                lambda whole: b"",
                lambda whole: whole[: len(whole) // 2],
                lambda whole: bytes(len(whole)),
                lambda whole: whole[:400] + bytes([whole[400] ^ 1]) + whole[401:],
            )
        ],
        *[
            (CONFIG_FILE, lambda _, content=content: content, "expected the record of a run")
            for content in (b"", b"{", b"[]", b'{"learner": "search"}', b'{"learner": "ppo", "args": 3}')
        ],
    ],
)
def test_a_damaged_file_is_named(unfinished: Args, name: str, damage: Any, message: str) -> None:
    path = unfinished.run / name
    damaged = damage(path.read_bytes())
    path.write_bytes(damaged)
    with pytest.raises(RecordError, match=message) as caught:
        train(unfinished)
    assert caught.value.field == str(path)
    assert path.read_bytes() == damaged


def test_a_record_of_an_earlier_version_is_read(unfinished: Args) -> None:
    path = unfinished.run / CONFIG_FILE
    path.write_text(path.read_text().replace('"seed":', '"threads": 1, "seed":'))
    assert RunRecord.read(unfinished.run).args == unfinished


@pytest.mark.parametrize(
    ("place", "message"), [(0, "nothing is saved yet"), (3, "2 of 4 rounds are saved in")]
)
def test_an_interrupted_run_says_what_is_saved(
    place: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    round_ = SearchRounds.round
    monkeypatch.setattr(SearchRounds, "round", lambda run: stop() if run.completed == place else round_(run))
    args = small_run(tmp_path / "run", "search")
    with pytest.raises(KeyboardInterrupt, match=message):
        train(args)
    assert (args.run / CHECKPOINT).exists() == (place > 0)


def test_a_checkpoint_that_cannot_be_written_is_found_before_the_first_round(
    unfinished: Args, monkeypatch: pytest.MonkeyPatch
) -> None:
    (unfinished.run / CHECKPOINT).unlink()
    (unfinished.run / CHECKPOINT).mkdir()
    monkeypatch.setattr(SearchRounds, "round", stop)
    with pytest.raises(IsADirectoryError, match=CHECKPOINT):
        train(unfinished)


def test_an_unfinished_run_is_not_continued_with_other_arguments(unfinished: Args) -> None:
    before = (unfinished.run / CHECKPOINT).read_bytes()
    with pytest.raises(ArgumentError, match=r"run: expected the arguments and versions of .*, got others"):
        train(dataclasses.replace(unfinished, seed=1))
    assert (unfinished.run / CHECKPOINT).read_bytes() == before
