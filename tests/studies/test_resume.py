"""A killed run is continued only with its own arguments; tests/slow/test_killed_runs.py compares the bits."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from killed_runs import GENERATIONS, killed_after
from resume_child import run
from small_runs import small_run

from training.outputs import CHECKPOINT


def test_an_unfinished_run_is_not_continued_with_other_arguments(tmp_path: Path) -> None:
    args = small_run(tmp_path / "run", "search", **GENERATIONS)
    assert killed_after(args, tmp_path / "weights", 1, 0)
    before = (args.run / CHECKPOINT).read_bytes()
    with pytest.raises(FileExistsError, match=r"run: expected the arguments and versions of .*, got others"):
        run(dataclasses.replace(args, seed=1), tmp_path / "weights")
    assert (args.run / CHECKPOINT).read_bytes() == before
