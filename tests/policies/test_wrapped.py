"""Models in wrapped environments of stable-baselines3: whole episodes, judged by the flocks behind them."""

from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box
from option_table import doomed, small_flock
from sb3_contrib import RecurrentPPO
from stable_baselines3 import A2C, PPO
from stable_baselines3.common.vec_env import VecEnvWrapper, VecFrameStack, VecMonitor, VecNormalize

import flockesc_env as fe
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.sb3 import FlockEvalCallback, vec_env

SETTINGS: dict[str, Any] = {"device": "cpu", "seed": 0, "n_steps": 5}
PLAIN = vec_env(doomed(num_agents=5), 2, per_agent=True)


class WithTwo(VecEnvWrapper):
    """Adds the agent's last two ranges, over the largest one."""

    def __init__(self, venv: Any) -> None:
        space = venv.observation_space
        low, high = np.append(space.low, [0, 0]), np.append(space.high, [1, 1])
        super().__init__(venv, Box(low.astype(np.float32), high.astype(np.float32)))

    def reset(self) -> Any:
        self.last = np.zeros((self.num_envs, 2), np.float32)
        return np.hstack([self.venv.reset(), self.last])

    def step_async(self, actions: Any) -> None:
        flocks: Any = self.venv.unwrapped
        shares = flocks.policy_spec.actions.to_ranges(actions, self.num_envs) / flocks.max_range
        self.last = np.stack([shares, self.last[:, 0]], axis=1).astype(np.float32)
        self.venv.step_async(actions)

    def step_wait(self) -> Any:
        observations, rewards, dones, infos = self.venv.step_wait()
        for slot in np.flatnonzero(dones):
            row = infos[slot]["terminal_observation"]
            infos[slot]["terminal_observation"] = np.append(row, self.last[slot])
        self.last[dones] = 0
        return np.hstack([observations, self.last]), rewards, dones, infos


@pytest.mark.parametrize("algorithm", [A2C, RecurrentPPO])
@pytest.mark.parametrize("reward", ["team", "individual"])
def test_without_wrappers_outcomes_are_those_of_a_rollout(algorithm: Any, reward: str) -> None:
    """Flocks that end early and chunks that are not full change nothing."""
    env = vec_env(doomed(num_agents=5), 2, per_agent=True, reward=reward)
    policy = "MlpPolicy" if algorithm is A2C else "MlpLstmPolicy"
    model = algorithm(policy, vec_env(doomed(num_agents=5), per_agent=True, reward=reward), **SETTINGS)
    expected = vars(fe.rollout(model, [7, 3, 3, 3], batch_size=2))  # torch rounds 5 and 10 rows differently
    for wrapped in (env, VecMonitor(env)):
        played = vars(fe.rollout(model, [7, 3, 3], env=wrapped))
        np.testing.assert_equal(played, {name: column[:3] for name, column in expected.items()})
        with pytest.raises(fe.ResetNeededError):
            wrapped.step(np.zeros((10, 1), np.float32))
        wrapped.reset()


def test_an_own_observation_is_trained_judged_and_compared() -> None:
    """Statistics of a VecNormalize follow the training's, and do not learn from evaluations."""

    def make() -> Any:
        return VecFrameStack(VecNormalize(WithTwo(vec_env(small_flock(), 2, per_agent=True))), 2)

    env, callback = make(), FlockEvalCallback(5, 3, eval_env=make())
    models = []
    for each, judge in ((env, callback), (make(), None)):
        models.append(PPO("MlpPolicy", each, **SETTINGS, batch_size=50).learn(100, callback=judge))
    parts = [[part.detach().numpy() for part in model.policy.parameters()] for model in models]
    np.testing.assert_equal(*parts)  # the callback does not change the training
    statistics = env.venv.obs_rms
    np.testing.assert_array_equal(callback.eval_env.venv.obs_rms.mean, statistics.mean)
    judged = fe.rollout(models[0], TUNING[:3], env=callback.eval_env)
    assert judged.min_mean_distance.mean() == callback.history[-1][1]
    assert callback.eval_env.venv.training
    assert callback.eval_env.venv.obs_rms.count == statistics.count
    found = fe.compare(None, models[0], "stubborn-leaders", env=env, num_flocks=3, num_tuning=2)
    played = fe.rollout(models[0], HELD_OUT[:3], env=env)
    np.testing.assert_array_equal(found.values["PPO"], played.min_mean_distance)


OTHER = vec_env(small_flock(), per_agent=True)
BAD: dict[str, tuple[Any, dict[str, Any], str]] = {
    "no flocks": (vec_env("paper-line"), {}, "env: expected flocks of sb3.vec_env"),
    "gymnasium": (fe.FlockEscapeEnv(), {}, "env: expected flocks of sb3.vec_env"),
    "scenarios": (
        vec_env([small_flock(), small_flock(num_steps=9)], 2),
        {},
        "env.scenarios: expected the sa",
    ),
    "spaces": (VecFrameStack(PLAIN, 2), {}, "env.observation_space: expected Box.*, that of the model, got"),
    "statistics": (VecNormalize(PLAIN), {}, "env: expected a VecNormalize if and only if the model's env"),
    "scenario": (PLAIN, {"scenario": "pursuit"}, "scenario: expected that of env"),
    "options": (PLAIN, {"max_range": 9.0}, "max_range: expected 40.0 from env, got 9.0 from the caller"),
    "view": (PLAIN, {"per_agent": False}, "per_agent: expected True from env, got False"),
    "batch": (PLAIN, {"batch_size": 3}, "batch_size: expected None beside env, got 3"),
    "policy": (PLAIN, {"policy": "fixed:3"}, "policy: expected a model of stable-baselines3 beside env"),
}


@pytest.mark.parametrize("name", BAD)
def test_other_environments_are_refused(name: str) -> None:
    env, options, message = BAD[name]
    model = A2C("MlpPolicy", OTHER, **SETTINGS)
    with pytest.raises(fe.InputError, match=message):
        fe.rollout(**{"policy": model, "seeds": 2, **options}, env=env)


def test_the_environment_of_the_training_is_no_eval_env() -> None:
    model = A2C("MlpPolicy", OTHER, **SETTINGS)
    with pytest.raises(fe.InputError, match="eval_env: expected another environment"):
        model.learn(10, callback=FlockEvalCallback(5, 2, eval_env=OTHER))
