"""What a new user types without reading works, or the error says what to type."""

from pathlib import Path

import pytest

from flockesc_env import InputError

STEPS = {
    "PPO by an id": """
import flockesc_env
from stable_baselines3 import PPO
model = PPO("MlpPolicy", "flockesc/one-range-v1", n_steps=64, device="cpu").learn(64)
assert flockesc_env.rollout(model, seeds=2).min_mean_distance.shape == (2,)
""",
    "policies by name": """
from flockesc_env import load_policy, parallel_env
for name in ("per-agent-visible/search", "stubborn-leaders"):
    policy = load_policy(name)
    observations, _ = parallel_env(policy.scenario, **policy.options).reset(seed=1)
    action, _ = policy.predict(observations["agent_000"])
    assert action.shape == (1,)
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
}

WRONG = {
    "load_policy('stubborn-leader')": "did you mean stubborn-leaders",
    "parallel_env(reward='teem')": "did you mean team",
    "parallel_env(objective='mean_distance')": "did you mean min_mean_distance",
    "parallel_env(predator_sensing_range=None)": "math.inf: agents see the predator at any distance",
    "rollout(object(), seeds=2)": "an object with a method act, a model of stable-baselines3, a name",
}


@pytest.mark.parametrize("step", STEPS)
def test_it_works(step: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(STEPS[step], {})  # noqa: S102, our own text


@pytest.mark.parametrize(("typed", "told"), WRONG.items(), ids=WRONG)
def test_the_error_says_what_to_type(typed: str, told: str) -> None:
    names = "from flockesc_env import load_policy, parallel_env, rollout\n"
    with pytest.raises(InputError, match=told):
        exec(names + typed, {})  # noqa: S102, our own text
