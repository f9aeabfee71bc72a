"""BenchMARL trains on the flock's tasks: a few iterations of MAPPO and IPPO."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest
from benchmarl.algorithms import IppoConfig, MappoConfig, MasacConfig
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.deepsets import DeepsetsConfig
from benchmarl.models.mlp import MlpConfig
from torchrl.envs import check_env_specs

from flockesc_env import FlockScenario, load_policy
from flockesc_env.benchmarl import FlockTask
from flockesc_env.common.errors import InputError
from flockesc_env.taskset import tasks

# BenchMARL uses deprecated names of TorchRL.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")

ROOT = Path(__file__).parent.parent
SMALL = {
    "scenario": FlockScenario(num_agents=4, num_steps=20),
    "steps_per_action": 4,
    "reward": "individual_distance_change",
}
ACTIONS, FLOCKS = 5, 4


def experiment(algorithm: Any, critic: Any, folder: Path, **changes: Any) -> Experiment:
    config = ExperimentConfig.get_from_yaml()
    settings = {
        "max_n_iters": 3,
        "max_n_frames": None,
        "on_policy_n_envs_per_worker": FLOCKS,
        "on_policy_collected_frames_per_batch": FLOCKS * ACTIONS,
        "on_policy_n_minibatch_iters": 2,
        "on_policy_minibatch_size": 10,
        "off_policy_n_envs_per_worker": FLOCKS,
        "off_policy_collected_frames_per_batch": FLOCKS * ACTIONS,
        "off_policy_n_optimizer_steps": 2,
        "off_policy_train_batch_size": 10,
        "off_policy_memory_size": 100,
        "evaluation_episodes": 2,
        "evaluation_interval": FLOCKS * ACTIONS,
        "render": False,
        "loggers": ["csv"],
        "save_folder": str(folder),
        **changes,
    }
    for name, value in settings.items():
        setattr(config, name, value)
    task = FlockTask.PER_AGENT_VISIBLE.get_task(SMALL)
    models = MlpConfig.get_from_yaml(), critic.get_from_yaml()
    return Experiment(task, algorithm.get_from_yaml(), models[0], 0, config, critic_model_config=models[1])


@pytest.mark.parametrize("task", list(FlockTask))
def test_tasks(task: Any) -> None:
    loaded = task.get_task()
    env = loaded.get_env_fun(num_envs=2, continuous_actions=True, seed=3, device="cpu")()
    known = tasks[task.name.lower().replace("_", "-")]
    assert loaded.max_steps(env) == 240 / env.options.steps_per_action
    for name, value in known.options.items():
        chosen = getattr(env.options, name)
        assert (list(chosen) if isinstance(value, list) else chosen) == value
    assert loaded.action_spec(env)["agents", "action"].shape == (300, 1)
    entries = len(env.policy_spec.layout.names)
    assert loaded.observation_spec(env)["agents", "observation"].shape == (300, entries)
    assert len(loaded.group_map(env)["agents"]) == 300


@pytest.mark.parametrize("continuous", [True, False])
def test_specs(continuous: bool) -> None:
    task = FlockTask.PER_AGENT_VISIBLE.get_task(SMALL)
    check_env_specs(task.get_env_fun(num_envs=2, continuous_actions=continuous, seed=3, device="cpu")())


def test_unknown_options_are_refused() -> None:
    task = FlockTask.PER_AGENT_VISIBLE.get_task({"horizon": 3})
    with pytest.raises(InputError, match="horizon"):
        task.get_env_fun(num_envs=2, continuous_actions=True, seed=3, device="cpu")()


@pytest.mark.parametrize(
    ("algorithm", "critic"),
    [
        (MappoConfig, MlpConfig),
        (MappoConfig, DeepsetsConfig),
        (IppoConfig, MlpConfig),
        (MasacConfig, DeepsetsConfig),
    ],
)
def test_training(algorithm: Any, critic: Any, tmp_path: Path) -> None:
    trained = experiment(algorithm, critic, tmp_path)
    trained.run()
    assert trained.n_iters_performed == 3
    assert math.isfinite(trained.mean_return)
    (logged,) = tmp_path.rglob("collection_info_min_mean_distance.csv")
    assert len(logged.read_text().splitlines()) == 3


def test_training_with_discrete_actions(tmp_path: Path) -> None:
    trained = experiment(MappoConfig, MlpConfig, tmp_path, prefer_continuous_actions=False)
    trained.run()
    assert trained.action_spec["agents", "action"].space.n == 21


@pytest.mark.parametrize(
    ("algorithm", "interface", "ranges"),
    [
        ("mappo", "flocks", ()),
        ("ippo", "flocks", ()),
        ("iql", "flocks", (0.0, 5.0, 10.0, 15.0, 20.0)),
        ("mappo", "pettingzoo", ()),
    ],
)
def test_the_example(algorithm: str, interface: str, ranges: tuple[float, ...], tmp_path: Path) -> None:
    command = [sys.executable, "-W", "ignore", ROOT / "examples" / "benchmarl_mappo.py"]
    short = ["--iterations", "1", "--flocks", "1", "--held-out", "4", "--folder", tmp_path]
    output = tmp_path / "policy.npz"
    chosen = ["--algorithm", algorithm, "--interface", interface, "--output", output]
    done = subprocess.run([*command, *short, *chosen], capture_output=True, text=True, check=True)  # noqa: S603
    assert "over the best fixed range" in done.stdout.splitlines()[-1]
    assert load_policy(output).architecture.ranges == ranges


def test_names_of_the_docs() -> None:
    pages = "".join(page.read_text("utf-8") for page in (ROOT / "docs").glob("*.md"))
    names = set(re.findall(r"flockesc_env\.benchmarl\.\w+", pages))
    assert names
    for name in names:
        resolve_name(name)
