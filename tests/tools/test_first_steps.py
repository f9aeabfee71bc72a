"""What a new user types without reading works, or the error says what to type."""

from pathlib import Path

import pytest

from flockesc_env import InputError

STEPS = {
    "the wrappers of CleanRL": """
import gymnasium as gym, flockesc_env, numpy as np
def make():
    env = gym.make("flockesc/one-range-v1")
    env = gym.wrappers.RecordEpisodeStatistics(gym.wrappers.FlattenObservation(env))
    env = gym.wrappers.NormalizeObservation(gym.wrappers.ClipAction(env))
    env = gym.wrappers.TransformObservation(env, lambda seen: np.clip(seen, -10, 10), env.observation_space)
    env = gym.wrappers.NormalizeReward(env, gamma=0.99)
    return gym.wrappers.TransformReward(env, lambda reward: np.clip(reward, -10, 10))
envs = gym.vector.SyncVectorEnv([make] * 2)
envs.reset(seed=1)
for _ in range(60):
    *_, infos = envs.step(envs.action_space.sample())
assert infos["episode"]["l"].tolist() == [60, 60]
""",
    "PPO by an id": """
import flockesc_env
from stable_baselines3 import PPO
model = PPO("MlpPolicy", "flockesc/one-range-v1", n_steps=64, device="cpu").learn(64)
assert flockesc_env.rollout(model, seeds=2).min_mean_distance.shape == (2,)
""",
    "PettingZoo": """
from flockesc_env import flockesc_v1
env = flockesc_v1.parallel_env()
env.reset(seed=1)
env.step({agent: env.action_space(agent).sample() for agent in env.agents})
""",
    "policies by name": """
from flockesc_env import load_policy, parallel_env
for name in ("per-agent-visible/search", "stubborn-leaders"):
    policy = load_policy(name)
    observations, _ = parallel_env(policy.scenario, **policy.options).reset(seed=1)
    action, _ = policy.predict(observations["agent_000"])
    assert action.shape == (1,)
""",
    "compare": """
from flockesc_env import tasks
compared = tasks["per-agent-visible"].compare("per-agent-visible/search", num_flocks=2)
assert "| per-agent-visible/search |" in str(compared)
assert "per-agent-visible" in repr(tasks)
""",
    "check_env, a video and a limit": """
import gymnasium as gym, flockesc_env
from gymnasium.utils.env_checker import check_env
env = gym.make("flockesc/one-range-v1", render_mode="rgb_array", max_episode_steps=3)
check_env(env.unwrapped, skip_render_check=True)
env = gym.wrappers.RecordVideo(gym.wrappers.TimeAwareObservation(env), "videos", disable_logger=True)
env.reset(seed=1)
assert [env.step(env.action_space.sample())[3] for _ in range(3)] == [False, False, True]
env.close()
""",
    "rollout": """
from flockesc_env import FixedRange, rollout
assert len(rollout(FixedRange(12.0), seeds=20).min_mean_distance) == 20
assert len(rollout("paper-line", FixedRange(0.1), seeds=3).escape_distance) == 3
""",
}

WRONG = {
    "load_policy('per-agent-visible/serch')": "did you mean per-agent-visible/search",
    "load_policy('stubborn-leader')": "did you mean stubborn-leaders",
    "tasks['one-rang']": "did you mean one-range",
    "tasks['one-range'].parallel_env()": "one range per agent; env has one per flock",
    "tasks['per-agent-visible'].env()": "one range per flock; parallel_env and vec_env have one per agent",
    "parallel_env(reward='teem')": "did you mean team",
    "parallel_env(objective='mean_distance')": "did you mean min_mean_distance",
    "parallel_env(predator_sensing_range=None)": "math.inf: agents see the predator at any distance",
    "rollout(object(), seeds=2)": "an object with a method act, a model of stable-baselines3, a name",
    "load_policy('per-agent-visible/search').bind(parallel_env())": r"use \*\*policy.options",
    "tasks['per-agent-visible'].compare('turn-away')": "turn-away: profile_ranges: expected none",
    "gymnasium.make('flockesc/per-agent-visible-v1')": "make_vec",
}


@pytest.mark.parametrize("step", STEPS)
def test_it_works(step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(STEPS[step], {})  # noqa: S102, our own text


@pytest.mark.parametrize(("typed", "told"), WRONG.items(), ids=WRONG)
def test_the_error_says_what_to_type(typed: str, told: str) -> None:
    names = "import gymnasium\nfrom flockesc_env import load_policy, parallel_env, rollout, tasks\n"
    with pytest.raises(InputError, match=told):
        exec(names + typed, {})  # noqa: S102, our own text
