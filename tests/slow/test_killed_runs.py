"""A run that is killed and started again ends with the bits of a run that nobody interrupts."""

from pathlib import Path

import pytest
from killed_runs import check_killed_run


@pytest.mark.parametrize("learner", ["search", "per-agent PPO", "shared PPO", "TQC"])
def test_a_killed_run_ends_like_one_left_alone(learner: str, tmp_path: Path) -> None:
    check_killed_run(learner, tmp_path)
