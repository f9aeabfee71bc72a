"""``SB3Policy``: states of recurrent models start with every episode, and models must fit the environment."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium.wrappers import NormalizeObservation, TimeAwareObservation, TimeLimit
from option_table import EVERY_STEP, small_flock
from rounding import actor_layers, float32_error
from sb3_contrib import ARS, TQC, RecurrentPPO
from stable_baselines3 import A2C, DDPG, PPO, SAC, TD3
from stable_baselines3.common.vec_env import DummyVecEnv, VecFrameStack, VecMonitor, VecNormalize

import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.policies import SB3Policy, bind
from flockesc_env.sb3 import RangePolicy, vec_env

SCENARIO = small_flock(num_agents=7, num_steps=12, predator_range=60.0)
SEEDS = [3, 4]
T, N = SCENARIO.num_steps, SCENARIO.num_agents
TAKEN = {"max_range": 50.0, "min_range": 5.0, "steps_per_action": 2}
OTHERS = {"per_agent": True, "action_mode": "range", **TAKEN}
SIZES = {"n_steps": 8, "batch_size": 8, "device": "cpu", "seed": 0}
NARROW = {"net_arch": [8, 4]}  # tanh layers of PPO and A2C, ReLU layers of the others
OWN = {"max_range": 100.0, "steps_per_action": 2, "per_agent": True}


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


def test_the_state_of_a_row_starts_with_its_episode() -> None:
    """One flock of a vector environment is reset during the episode of the other."""
    env = BatchVectorEnv(2, SCENARIO, **EVERY_STEP)
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
    env = vec_env(SCENARIO, per_agent=True, **EVERY_STEP)
    small = {"lstm_hidden_size": 8, "net_arch": [8]}
    sizes: Any = {"n_steps": 8, "batch_size": 14, "policy_kwargs": small}
    model = RecurrentPPO("MlpLstmPolicy", env, **sizes, device="cpu", seed=0)
    calls: list[Any] = []

    def predict(*seen: Any, real: Any = model.predict, **named: Any) -> tuple[Any, Any]:
        found: tuple[Any, Any] = real(*seen, **named)
        calls.append((*seen, named["state"], named["episode_start"], found))
        return found

    monkeypatch.setattr(model, "predict", predict)
    policy = SB3Policy(model)
    for seed in SEEDS:
        calls.clear()
        run = fe.simulate(SCENARIO, policy=policy, seed=seed, per_agent=True)
        env.seed(seed)
        rows, state, starts = env.reset(), None, np.ones(N, bool)
        for (*given, (actions, after)), ranges in zip(calls, run.interaction_ranges, strict=True):
            np.testing.assert_equal(given, [rows, state, starts])
            rows, _, starts, infos = env.step(actions)
            assert ranges.tolist() == [info["interaction_range"] for info in infos]
            state = after


@pytest.mark.parametrize("field", OTHERS)
def test_a_model_of_another_environment_is_refused(field: str) -> None:
    policy, options = SB3Policy(model_of(PPO)), {field: OTHERS[field]}
    assert len(fe.rollout(SCENARIO, policy, [1]).seeds) == 1
    with pytest.raises(fe.InputError, check=lambda error: error.field == field) as caught:
        fe.rollout(SCENARIO, policy, [1], **options)
    if field in TAKEN:  # the line that the error names plays
        assert f"policy.with_options({field}={OTHERS[field]!r})" in str(caught.value)
        assert len(fe.rollout(policy.with_options(**options), [1]).seeds) == 1


def normalized(env: Any, **settings: Any) -> VecNormalize:
    """Return a wrapper with statistics that no observation of a short run has."""
    wrapper = VecNormalize(env, **settings)
    rng = np.random.default_rng(0)
    wrapper.obs_rms.mean, wrapper.obs_rms.var = rng.uniform(-0.5, 0.5, (2, *env.observation_space.shape)) ** 2
    wrapper.training = False
    return wrapper


@pytest.mark.parametrize(
    "wrap",
    [normalized, lambda env: VecMonitor(normalized(env)), lambda env: VecNormalize(env, norm_obs=False)],
)
@pytest.mark.parametrize("is_loaded", [False, True])
def test_observations_are_normalized_as_in_the_training(wrap: Any, is_loaded: bool, tmp_path: Path) -> None:
    env = wrap(vec_env(SCENARIO, per_agent=True, **EVERY_STEP))
    model = PPO("MlpPolicy", env, **SIZES)
    env.seed(3)
    rows, expected = env.reset(), []
    for _ in range(T):
        rows, _, _, infos = env.step(model.predict(rows, deterministic=True)[0])
        expected.append([info["interaction_range"] for info in infos])
    policy = SB3Policy(model)
    if is_loaded:
        model.save(tmp_path / "model.zip")
        model.get_vec_normalize_env().save(tmp_path / "statistics.pkl")
        statistics = VecNormalize.load(
            tmp_path / "statistics.pkl", vec_env(SCENARIO, per_agent=True, **EVERY_STEP)
        )
        policy = SB3Policy(PPO.load(tmp_path / "model.zip"), vec_normalize=statistics)
    run = fe.simulate(SCENARIO, policy=policy, seed=3, **EVERY_STEP)
    assert run.interaction_ranges.tolist() == expected


@pytest.mark.parametrize(("algorithm", "has_env"), [(A2C, False), (A2C, True), (SAC, False)])
def test_a_model_without_the_statistics_of_its_observations_is_refused(
    algorithm: Any, has_env: bool, tmp_path: Path
) -> None:
    plain = vec_env(SCENARIO, per_agent=True)
    algorithm("MlpPolicy", VecNormalize(plain), device="cpu", seed=0).learn(1).save(tmp_path / "model.zip")
    model = algorithm.load(tmp_path / "model.zip", env=plain if has_env else None)
    known = {"scenario": SCENARIO, "per_agent": True}
    with pytest.raises(fe.InputError, match=r"^vec_normalize: expected VecNormalize.load\(path, venv\)"):
        fe.rollout(SB3Policy(model).with_options(**known), [1])
    policy = SB3Policy(model, vec_normalize=VecNormalize(vec_env(SCENARIO)))
    with pytest.raises(fe.InputError, match=r"statistics of 13 entries" if has_env else "observation_space"):
        fe.rollout(policy, [1])
    said = SB3Policy(model, vec_normalize=False).with_options(**known)
    assert len(fe.rollout(said, [1]).seeds) == 1


def test_a_loaded_model_plays_as_it_was_trained(tmp_path: Path) -> None:
    """``RangePolicy`` stores its scenario and options; with another class they have to be given."""
    env = vec_env(SCENARIO, **OWN)
    stored = {"spec": env.get_attr("policy_spec")[0], "first_range": 30.0}
    for policy_class, settings in ((RangePolicy, stored), ("MlpPolicy", {})):
        model = PPO(policy_class, env, policy_kwargs=settings, **SIZES)
        expected = fe.rollout(model, SEEDS).min_mean_distance.tolist()
        model.save(tmp_path / "model.zip")
        alone, with_env = (PPO.load(tmp_path / "model.zip", env=one, device="cpu") for one in (None, env))
        assert fe.rollout(SCENARIO, alone, SEEDS, **OWN).min_mean_distance.tolist() == expected
        assert fe.rollout(with_env, SEEDS).min_mean_distance.tolist() == expected
        if settings:
            assert fe.rollout(alone, SEEDS).min_mean_distance.tolist() == expected
            alone.set_env(vec_env(SCENARIO, **(OWN | {"max_range": 50.0})))
            message = r"^max_range: expected 100.0 from the spec stored in the model, got 50.0 from the env"
        else:
            message = r"model.env: expected .* PPO.load\(path, env=env\)"
            with pytest.raises(fe.InputError, match=message):
                fe.tasks["per-agent-visible"].compare(alone, num_flocks=1)
        with pytest.raises(fe.InputError, match=message):
            fe.rollout(SCENARIO, alone, SEEDS)


@pytest.mark.parametrize(
    ("algorithm", "settings"),
    [(PPO, {}), (PPO, {"squash_output": True}), *((each, {}) for each in (A2C, SAC, TQC, TD3, DDPG))],
)
@pytest.mark.parametrize("wrap", [lambda env: env, lambda env: normalized(env, clip_obs=np.inf)])
def test_networks_of_all_algorithms_act_as_their_models(algorithm: Any, settings: Any, wrap: Any) -> None:
    env = wrap(vec_env(SCENARIO, per_agent=True, **EVERY_STEP))
    sde = {"use_sde": True} if settings else {}
    model = algorithm("MlpPolicy", env, device="cpu", seed=1, policy_kwargs={**NARROW, **settings}, **sde)
    with torch.no_grad():
        for weights in model.policy.parameters():
            weights.normal_(0, 0.3)
    network, spec = SB3Policy(model).network(), env.get_attr("policy_spec", 0)[0]
    rows = np.random.default_rng(0).uniform(spec.layout.low, spec.layout.high, (50, 13)).astype(np.float32)
    actions = SB3Policy(model).act(rows, spec)
    assert network.policy_spec.options == spec.options
    model.env = None  # as after a load without one: the wrapper knows the environment, too
    if isinstance(env, VecNormalize):
        again = SB3Policy(model, vec_normalize=env).network()
        assert again.parameters.tolist() == network.parameters.tolist()
    seen = env.normalize_obs(rows) if isinstance(env, VecNormalize) else rows
    error = float32_error(actor_layers(model), seen).max()
    assert np.ptp(actions) > 100 * error
    np.testing.assert_allclose(network.act(rows, spec), actions, rtol=0, atol=error)


def model_of(algorithm: Any, env: Any = None, **settings: Any) -> Any:
    return algorithm("MlpPolicy", env or vec_env(SCENARIO), device="cpu", policy_kwargs=settings)


def of_environment(env: Any) -> Any:
    model = model_of(PPO)
    model.env = env
    return model


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: model_of(ARS), "model: expected an MlpPolicy of PPO, A2C, .* got ARS"),
        (
            lambda: RecurrentPPO("MlpLstmPolicy", vec_env(SCENARIO), device="cpu"),
            "model: expected a model without a memory, got RecurrentPPO",
        ),
        (lambda: of_environment(None), r"model.env: .* after PPO.load\(path, env=env\), .* got none"),
        (lambda: of_environment(object()), "model.env: .* got <object"),  # as those of SuperSuit
        (lambda: model_of(PPO, "Pendulum-v1"), "model.env: expected .* got <.*DummyVecEnv"),
        (
            lambda: model_of(PPO, vec_env(SCENARIO, action_mode="range")),
            "model.env.options.action_mode: expected 'normalized' or 'discrete', got 'range'",
        ),
        (
            lambda: model_of(PPO, normalized(vec_env(SCENARIO), clip_obs=1.0)),
            "vec_normalize.clip_obs: expected numpy.inf, .* got 1.0",
        ),
        (
            lambda: model_of(PPO, DummyVecEnv([lambda: NormalizeObservation(fe.FlockEscapeEnv(SCENARIO))])),
            r"model.observation_space: .* got \(18,\) with other bounds",
        ),
    ],
)
def test_models_that_are_no_network_of_the_package_are_refused(make: Any, message: str) -> None:
    policy = SB3Policy(make())
    with pytest.raises(fe.InputError, match=f"^{message}"):
        policy.network()


@pytest.mark.parametrize(
    "env",
    [
        VecFrameStack(vec_env(SCENARIO, per_agent=True), 2),
        DummyVecEnv([lambda: TimeAwareObservation(TimeLimit(fe.FlockEscapeEnv(SCENARIO), T))]),
    ],
)
def test_a_model_of_wrapped_observations_fits_neither_view(env: Any) -> None:
    message = r"shape \((18|13),\) for one row per (flock|agent), .*VecFrameStack.* got"
    with pytest.raises(fe.InputError, match=f"{message} {re.escape(str(env.observation_space.shape))}"):
        fe.rollout(SCENARIO, SB3Policy(model_of(PPO, env)), [1])
