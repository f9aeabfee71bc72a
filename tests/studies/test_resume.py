"""An unfinished run is continued only with its own arguments; tests/slow/test_killed_runs.py kills runs."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from small_runs import small_run

from training import search
from training.outputs import CHECKPOINT
from training.train import train


def test_an_unfinished_run_is_not_continued_with_other_arguments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    args = small_run(tmp_path / "run", "search")
    monkeypatch.setattr(search, "finish", stop)
    with pytest.raises(KeyboardInterrupt):
        train(args)
    before = (args.run / CHECKPOINT).read_bytes()
    with pytest.raises(FileExistsError, match=r"run: expected the arguments and versions of .*, got others"):
        train(dataclasses.replace(args, seed=1))
    assert (args.run / CHECKPOINT).read_bytes() == before
