"""``SB3Policy``: states of recurrent models start with every episode, and models must fit the environment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from option_table import small_flock
from rounding import actor_layers, float32_error
from same import outcome
from sb3_contrib import TQC, RecurrentPPO
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import flockesc_env as fe
from flockesc_env.common.errors import ArgumentError
from flockesc_env.policies import (
    SB3Policy,
    ScheduledRange,
    bind,
)
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

SCENARIO = small_flock(num_agents=7, num_steps=12, predator_range=60.0)
SEEDS = [3, 4]
T, N = SCENARIO.num_steps, SCENARIO.num_agents


class Mood:
    """A recurrent model with SB3's interface whose range grows with each action of an episode."""

    def predict(
        self, observations: np.ndarray, state: Any, episode_start: np.ndarray, deterministic: bool
    ) -> tuple[np.ndarray, Any]:
        before = np.zeros(len(observations), np.float32) if state is None else state[0]
        now = np.where(episode_start, 0, before) + np.float32(0.125)
        return now[:, np.newaxis] - 1, (now,)


def mood(steps: int) -> np.ndarray:
    """Return the ranges in m that ``Mood`` sets in the first steps of an episode, at most 16."""
    return 100 * np.arange(1, steps + 1) / 16


def test_the_state_of_a_recurrent_model_is_kept_and_starts_with_every_episode() -> None:
    policy = SB3Policy(Mood())
    for seeds in ([1, 2, 3], [4]):  # different rows than before
        assert outcome(fe.rollout(SCENARIO, policy, seeds)).tolist() == (
            outcome(fe.rollout(SCENARIO, ScheduledRange(mood(T)), seeds)).tolist()
        )
    assert fe.record(SCENARIO, policy, 1).interaction_ranges[:, 0].tolist() == mood(T).tolist()
    line = fe.LineScenario(num_agents=8, max_steps=5)
    runs = [fe.rollout(line, each, [1, 2]) for each in (policy, ScheduledRange(mood(5) / 100))]
    assert runs[0].escape_distance.tolist() == runs[1].escape_distance.tolist()


def test_the_state_of_a_row_starts_with_its_episode() -> None:
    """One flock of a vector environment is reset during the episode of the other."""
    env = fe.FlockVectorEnv(2, SCENARIO)
    act = bind(SB3Policy(Mood()), env)
    observations, _ = env.reset(seed=0)
    ranges = []
    for step in range(8):
        if step == 5:
            observations, _ = env.reset(options={"reset_mask": np.array([False, True])})
        observations, *_, info = env.step(act(observations))
        ranges.append(info["interaction_range"])
    expected = [mood(8), np.concatenate([mood(5), mood(3)])]
    np.testing.assert_array_equal(np.transpose(ranges), expected)


def test_a_recurrent_model_of_sb3_plays_like_its_own_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    env = AgentVecEnv(1, SCENARIO)
    model = RecurrentPPO("MlpLstmPolicy", env, n_steps=8, batch_size=14, device="cpu", seed=0)
    calls: list[Any] = []

    def predict(*seen: Any, real: Any = model.predict, **named: Any) -> tuple[Any, Any]:
        found: tuple[Any, Any] = real(*seen, **named)
        calls.append((*seen, named["state"], named["episode_start"], found))
        return found

    monkeypatch.setattr(model, "predict", predict)
    policy = SB3Policy(model)
    for seed in SEEDS:
        calls.clear()
        run = fe.record(SCENARIO, policy, seed, per_agent=True)
        env.seed(seed)
        rows, state, starts = env.reset(), None, np.ones(N, bool)
        for (*given, (actions, after)), ranges in zip(calls, run.interaction_ranges, strict=True):
            np.testing.assert_equal(given, [rows, state, starts])
            rows, _, starts, infos = env.step(actions)
            assert ranges.tolist() == [info["interaction_range"] for info in infos]
            state = after


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"per_agent": True}, "model.observation_space"),
        ({"action_mode": "range"}, "model.action_space"),
        ({"max_range": 50.0}, "max_range"),
        ({"min_range": 5.0}, "min_range"),
    ],
)
def test_a_model_of_another_environment_is_refused(options: dict[str, Any], field: str) -> None:
    policy = SB3Policy(PPO("MlpPolicy", FlockVecEnv(1, SCENARIO), n_steps=8, batch_size=8, device="cpu"))
    assert len(fe.rollout(SCENARIO, policy, [1]).seeds) == 1
    with pytest.raises(ArgumentError) as caught:
        fe.rollout(SCENARIO, policy, [1], **options)
    assert caught.value.field == field


@pytest.mark.parametrize("algorithm", [PPO, TQC])
def test_a_model_becomes_a_network_that_can_be_saved(algorithm: Any, tmp_path: Path) -> None:
    env = AgentVecEnv(1, SCENARIO, max_range=40.0)
    layers = {"net_arch": [8, 4], "activation_fn": torch.nn.Tanh}
    model = algorithm("MlpPolicy", env, policy_kwargs=layers, device="cpu", seed=1)
    network = SB3Policy(model).network()
    rows = np.random.default_rng(0).uniform(-1, 1, (50, len(env.policy_spec.layout.names))).astype(np.float32)
    actions = SB3Policy(model).act(rows, env.policy_spec)
    assert np.ptp(actions) > 0
    error = float32_error(actor_layers(model), rows)
    assert (np.abs(network.act(rows, env.policy_spec) - actions) <= error).all()
    fe.save_policy(
        fe.NamedPolicy("mine", network, True, {"max_range": 40.0}, SCENARIO), tmp_path / "mine.npz"
    )
    assert fe.load_policy(tmp_path / "mine.npz").policy.parameters.tolist() == network.parameters.tolist()


def test_models_that_are_no_network_of_the_package_are_refused() -> None:
    env = FlockVecEnv(1, SCENARIO)
    sizes = {"n_steps": 8, "batch_size": 8, "device": "cpu"}
    relu = PPO("MlpPolicy", env, policy_kwargs={"activation_fn": torch.nn.ReLU}, **sizes)
    scaled = PPO("MlpPolicy", VecNormalize(env, norm_obs=True), **sizes)
    meters = PPO("MlpPolicy", FlockVecEnv(1, SCENARIO, action_mode="range"), **sizes)
    alone = PPO("MlpPolicy", env, **sizes)
    alone.env = None
    with pytest.raises(ArgumentError, match=r"^layers: .* Linear, ReLU, Linear"):
        SB3Policy(relu).network()
    for model in (scaled, meters, alone, RecurrentPPO("MlpLstmPolicy", env, **sizes), Mood()):
        with pytest.raises(ArgumentError, match="model"):
            SB3Policy(model).network()
