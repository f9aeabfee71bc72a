"""A run that is killed and started again ends with the bits of a run that nobody interrupts."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest
from killed_runs import GENERATIONS, check_killed_run, killed_after
from resume_child import run
from small_runs import small_run

from training.outputs import CHECKPOINT


# tests/slow/test_killed_runs.py checks the other learners.
def test_a_killed_search_ends_like_one_left_alone(tmp_path: Path) -> None:
    check_killed_run("search", tmp_path)


def test_an_unfinished_run_is_not_continued_with_other_arguments(tmp_path: Path) -> None:
    args = small_run(tmp_path / "run", "search", **GENERATIONS)
    assert killed_after(args, tmp_path / "weights", 1, 0)
    before = (args.run / CHECKPOINT).read_bytes()
    with pytest.raises(FileExistsError, match=r"run: expected the arguments and versions of .*, got others"):
        run(dataclasses.replace(args, seed=1), tmp_path / "weights")
    assert (args.run / CHECKPOINT).read_bytes() == before
