"""``FlockTorchRLEnv`` returns the values of the PettingZoo environment, as TorchRL's own wrapper does."""

from __future__ import annotations

import copy
import pickle
import re
import subprocess
import sys
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
import pytest
import torch
from tensordict import TensorDict
from torchrl.collectors import Collector
from torchrl.envs import PettingZooWrapper, SerialEnv, check_env_specs
from torchrl.envs.utils import MarlGroupMapType

from flockesc_env import EnvOptions, FlockEscapeEnv, FlockScenario, load_policy, parallel_env
from flockesc_env.common.errors import InputError, ResetNeededError
from flockesc_env.scenario import ConstantVelocity, Intercept, PurePursuit
from flockesc_env.torchrl import FlockTorchRLEnv

# TorchRL warns about every PettingZoo version except one from 2023.
pytestmark = pytest.mark.filterwarnings("ignore:PettingZoo in TorchRL is tested:UserWarning")

ROOT = Path(__file__).parent.parent
SCENARIO = FlockScenario(num_agents=4, num_steps=40)
HUNTERS = (
    PurePursuit((-5.0, -5.0), (20.0, 20.0), max_turn_rate=4.0),
    Intercept((25.0, 0.0), (0.0, 15.0), max_turn_rate=3.0),
    ConstantVelocity((0.0, 25.0), (12.0, -12.0)),
)
DOOMED = FlockScenario(num_agents=3, num_steps=40, initial_side=20.0, capture_radius=4.0, predators=HUNTERS)
STEPS = SCENARIO.num_steps // EnvOptions.steps_per_action
"""Actions of an episode."""


def same(tensor: torch.Tensor, array: Any) -> None:
    np.testing.assert_array_equal(tensor.numpy(), array)


def wrapped() -> PettingZooWrapper:
    group_map = MarlGroupMapType.ALL_IN_ONE_GROUP
    return PettingZooWrapper(parallel_env(SCENARIO), group_map=group_map, use_mask=False)


@pytest.mark.parametrize("per_agent", [True, False])
@pytest.mark.parametrize(
    "options",
    [{}, {"action_mode": "range"}, {"action_mode": "discrete"}, {"scenario": DOOMED}],
    ids=["normalized", "range", "discrete", "capture"],
)
def test_specs(options: dict[str, Any], per_agent: bool) -> None:
    env = FlockTorchRLEnv(3, **{"scenario": SCENARIO, **options}, per_agent=per_agent)
    check_env_specs(env)
    assert env.batch_size == (3,)
    assert env.full_observation_spec[*["agents"] * per_agent, "observation"].is_in(
        env.reset()[*["agents"] * per_agent, "observation"]
    )


@pytest.mark.parametrize("action_mode", ["normalized", "discrete"])
@pytest.mark.parametrize("scenario", [SCENARIO, DOOMED], ids=["default", "capture"])
def test_episodes_equal_those_of_the_parallel_environment(scenario: FlockScenario, action_mode: str) -> None:
    options: dict[str, Any] = {"action_mode": action_mode, "reward": "individual"}
    env = FlockTorchRLEnv(3, scenario, **options)
    env.set_seed(3)
    torch.manual_seed(0)
    episodes = env.rollout(scenario.num_steps + 7, break_when_any_done=False)
    caught = 0
    for flock, episode in enumerate(episodes):
        plain = parallel_env(scenario, **options)
        observations, _ = plain.reset_array(seed=3 + flock)
        for step in episode:
            same(step["agents", "observation"], observations)
            result = plain.step_array(step["agents", "action"].numpy())
            observations, rewards, terminations, truncations, info = result
            seen = step["next"]
            same(seen["agents", "observation"], observations)
            same(seen["agents", "reward"][:, 0], rewards.astype(np.float32))
            same(seen["agents", "terminated"][:, 0], terminations)
            same(seen["agents", "truncated"][:, 0], truncations)
            same(seen["agents", "done"][:, 0], terminations | truncations)
            same(seen["terminated"], [terminations.all()])
            same(seen["truncated"], [truncations.any()])
            same(seen["done"], [not plain.agents])
            same(seen["info", "min_mean_distance"], [info["min_mean_distance"]])
            if scenario is DOOMED:
                same(seen["agents", "mask"], ~terminations)
                caught += terminations.any()
            if not plain.agents:
                observations, _ = plain.reset_array()
    assert (caught > 0) == (scenario is DOOMED)


def test_a_shared_range_equals_the_gymnasium_environment() -> None:
    env = FlockTorchRLEnv(2, SCENARIO, per_agent=False)
    env.set_seed(3)
    episodes = env.rollout(STEPS)
    plain = FlockEscapeEnv(SCENARIO)
    for flock, episode in enumerate(episodes):
        observation, _ = plain.reset(seed=3 + flock)
        for step in episode:
            same(step["observation"], observation)
            observation, reward, terminated, truncated, _ = plain.step(step["action"].numpy())
            same(step["next", "reward"], np.float32([reward]))
            assert step["next", "terminated"].item() == terminated
            assert step["next", "truncated"].item() == truncated
        same(episode["next", "observation"][-1], observation)


def test_several_scenarios() -> None:
    scenarios = [SCENARIO, SCENARIO.replace(num_steps=24, speed=5.0)]
    env = FlockTorchRLEnv(2, scenarios)
    env.set_seed(3)
    episodes = env.rollout(2 * STEPS, break_when_any_done=False)
    for flock, (episode, scenario) in enumerate(zip(episodes, scenarios, strict=True)):
        plain = parallel_env(scenario)
        observations, _ = plain.reset_array(seed=3 + flock)
        for step in episode:
            same(step["agents", "observation"], observations)
            observations, *_ = plain.step_array(step["agents", "action"].numpy())
            same(step["next", "agents", "observation"], observations)
            same(step["next", "done"], [not plain.agents])
            if not plain.agents:
                observations, _ = plain.reset_array()


def test_a_partial_reset_leaves_other_flocks() -> None:
    env, other = FlockTorchRLEnv(3, SCENARIO), FlockTorchRLEnv(3, SCENARIO)
    for each in (env, other):
        each.set_seed(3)
    start = env.reset()
    other.reset()
    action = env.full_action_spec.zero()
    after = env.step(start.clone().update(action))["next"]
    expected = other.step(start.clone().update(action))["next"]
    mask = torch.tensor([[False], [True], [False]])
    begun = env.reset(after.clone().set("_reset", mask))
    same(begun["agents", "observation"][[0, 2]], after["agents", "observation"][[0, 2]])
    plain = parallel_env(SCENARIO)
    plain.reset_array(seed=4)
    same(begun["agents", "observation"][1], plain.reset_array()[0])
    same(after["agents", "observation"], expected["agents", "observation"])  # not overwritten


def test_resets() -> None:
    env = FlockTorchRLEnv(2, SCENARIO)
    with pytest.raises(ResetNeededError):
        env.step(env.full_action_spec.zero())
    with pytest.raises(ResetNeededError):
        env.reset(TensorDict({"_reset": torch.tensor([[True], [False]])}, [2]))
    for seed in (-1, 2**64 - 1):
        with pytest.raises(InputError, match="seed"):
            env.set_seed(seed)
    env.set_seed(5)
    first = env.reset()["agents", "observation"]
    env.set_seed(5)
    same(env.reset()["agents", "observation"], first)
    assert not torch.equal(env.reset()["agents", "observation"], first)
    env.set_seed(None)
    assert not torch.equal(env.reset()["agents", "observation"], first)


def test_refused_actions() -> None:
    env = FlockTorchRLEnv(2, SCENARIO)
    start = env.reset()
    action = env.full_action_spec.zero()
    action["agents", "action"][1, 2] = 1.5
    with pytest.raises(InputError):
        env.step(start.update(action))


def test_snapshots_and_copies() -> None:
    env = FlockTorchRLEnv(2, SCENARIO)
    env.rollout(3)
    action = env.full_action_spec.zero()
    others = [copy.deepcopy(env), pickle.loads(pickle.dumps(env)), FlockTorchRLEnv(2, SCENARIO)]  # noqa: S301
    others[-1].set_state(env.get_state())
    expected = env.step(action.clone())["next", "agents", "observation"]
    for other in others:
        same(other.step(action.clone())["next", "agents", "observation"], expected)


def test_rendering() -> None:
    env = FlockTorchRLEnv(2, SCENARIO, render_mode="rgb_array")
    env.rollout(3)
    images = env.render()
    assert images is not None
    assert [image.shape for image in images] == [(512, 512, 3)] * 2
    env.close()
    assert env.is_closed


def test_a_collector_and_nested_batches() -> None:
    env = SerialEnv(2, lambda: FlockTorchRLEnv(2, SCENARIO))
    assert env.rollout(STEPS + 2, break_when_any_done=False).shape == (2, 2, STEPS + 2)
    collector = Collector(
        FlockTorchRLEnv(2, SCENARIO), frames_per_batch=2 * (STEPS + 5), total_frames=4 * (STEPS + 5)
    )
    for batch in collector:
        assert batch.shape == (2, STEPS + 5)
        assert batch["next", "done"].any()
    collector.shutdown()


def test_specs_of_the_wrapper() -> None:
    check_env_specs(wrapped())


def test_a_rollout_of_the_wrapper_equals_that_of_the_environment() -> None:
    env, own = wrapped(), FlockTorchRLEnv(1, SCENARIO)
    for each in (env, own):
        each.set_seed(3)
    own.reset()  # because `set_seed` of the wrapper resets, and `rollout` resets again
    torch.manual_seed(0)
    episode = env.rollout(100)
    assert episode.shape == (STEPS,)
    start = own.reset()
    same(start["agents", "observation"][0], episode["agents", "observation"][0])
    for step in episode:
        again = own.step(start.set(("agents", "action"), step["agents", "action"][None]))["next"]
        for name in ("observation", "reward", "truncated", "done"):
            same(again["agents", name][0], step["next", "agents", name])


@pytest.mark.parametrize("interface", ["flocks", "pettingzoo"])
def test_the_example_is_seeded(interface: str, tmp_path: Path) -> None:
    command = [sys.executable, "-W", "ignore", ROOT / "examples" / "torchrl_ppo.py", "--interface", interface]
    short = ["--iterations", "1", "--flocks", "1", "--held-out", "4"]
    files = [tmp_path / "first.npz", tmp_path / "second.npz"]
    runs = [
        subprocess.run([*command, *short, "--output", file], capture_output=True, text=True, check=True)  # noqa: S603
        for file in files
    ]
    gains = {run.stdout.splitlines()[-1] for run in runs}
    assert len(gains) == 1
    assert "over the best fixed range" in gains.pop()
    first, second = (load_policy(file).parameters for file in files)
    np.testing.assert_array_equal(first, second)


def test_names_of_the_docs() -> None:
    pages = "".join(page.read_text("utf-8") for page in (ROOT / "docs").glob("*.md"))
    names = set(re.findall(r"flockesc_env\.torchrl\.\w+", pages))
    assert names
    for name in names:
        resolve_name(name)


def test_settings_are_not_assigned_after_creation() -> None:
    env = FlockTorchRLEnv(2, SCENARIO)
    for name in ("scenario", "options", "max_range", "render_mode"):
        with pytest.raises(InputError, match=f"{name}: expected no assignment after creation"):
            setattr(env, name, "another")
    check_env_specs(env.to("cpu"))
