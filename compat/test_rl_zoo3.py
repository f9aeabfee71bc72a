"""rl_zoo3 trains on the package's ids with the hyperparameters of ``examples/rl_zoo3``."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

EXAMPLES = Path(__file__).parents[1] / "examples" / "rl_zoo3"
CASES = [
    (algorithm, env)
    for algorithm in ("ppo", "tqc")
    for env in yaml.safe_load((EXAMPLES / f"{algorithm}.yml").read_text("utf-8"))
]


@pytest.mark.parametrize(("algorithm", "env"), CASES)
def test_training(algorithm: str, env: str, tmp_path: Path) -> None:
    """A rollout of PPO takes 64 x 60 steps, more than the 2,000 that are asked for."""
    command = [
        *(sys.executable, "-P", "-m", "rl_zoo3.train", "--algo", algorithm, "--env", env),
        *("--gym-packages", "flockesc_env", "-conf", str(EXAMPLES / f"{algorithm}.yml")),
        *("--n-timesteps", "2000", "--eval-freq", "1000", "--n-eval-envs", "1", "--eval-episodes", "2"),
        *("--seed", "0", "--device", "cpu", "--log-folder", str(tmp_path)),
    ]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603, our own
    assert ended.returncode == 0, ended.stderr
    assert list(tmp_path.rglob("best_model.zip"))
    assert "mean_reward" in ended.stdout
