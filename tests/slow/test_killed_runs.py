"""A run that is killed and started again ends with the bits of a run that nobody interrupts."""

from pathlib import Path

import pytest
from killed_runs import check_killed_run, context

# Imported once, by the server that forks the runs; PyTorch imports the second at the first gradient step.
context.set_forkserver_preload(["training.train", "torch._dynamo"])


@pytest.mark.parametrize("learner", ["search", "imitation", "per-agent PPO", "shared PPO", "TQC"])
def test_a_killed_run_ends_like_one_left_alone(learner: str, tmp_path: Path) -> None:
    check_killed_run(learner, tmp_path)
