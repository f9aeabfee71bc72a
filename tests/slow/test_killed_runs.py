"""Killed and resumed runs of the learners that tests/studies/test_resume.py leaves out."""

from pathlib import Path

import pytest
from killed_runs import check_killed_run


@pytest.mark.parametrize("learner", ["per-agent PPO", "shared PPO", "TQC"])
def test_a_killed_run_ends_like_one_left_alone(learner: str, tmp_path: Path) -> None:
    check_killed_run(learner, tmp_path)
