"""The contract of stable-baselines3's VecEnv for one slot per flock and one per agent."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli_runs import Cli
from envs import draw
from gymnasium import Wrapper
from option_table import EVERY_STEP, doomed, small_flock
from same import spoil
from stable_baselines3 import A2C, PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

import flockesc_env as fe
from flockesc_env.envs.vector import BatchVectorEnv
from flockesc_env.episodes.splits import TUNING
from flockesc_env.policies import Pursue
from flockesc_env.sb3 import FlockEvalCallback, vec_env
from flockesc_env.scenario import Learned

FLOCKS = 3
PER_AGENT = pytest.mark.parametrize("per_agent", [False, True])


@pytest.mark.parametrize(
    ("scenario", "ends"),
    [
        (small_flock(), {True}),
        (doomed(num_agents=5), {True, False}),
        ([small_flock(), small_flock(num_steps=7), small_flock(capture_radius=1.0)], {True}),
    ],
    ids=["no capture", "capture", "several scenarios"],
)
@pytest.mark.parametrize(
    ("per_agent", "reward"), [(False, "team"), (True, "team"), (True, "individual_distance")]
)
def test_slots_equal_those_of_gymnasium_with_autoreset_in_the_same_step(
    per_agent: bool, reward: Any, scenario: Any, ends: set[bool]
) -> None:
    """``ends`` are the ways in which episodes end: by truncation (True) or termination.

    With ``infos="end"``, running slots share one new empty dict, and ended slots have the same infos.
    """
    options: Any = {"per_agent": per_agent, "reward": reward, **EVERY_STEP}
    env, sparse = (vec_env(scenario, FLOCKS, infos=infos, **options) for infos in ("all", "end"))
    twin = BatchVectorEnv(env.num_envs, scenario, autoreset_mode="SameStep", **options)
    expected, _ = twin.reset(seed=11)
    for each in (env, sparse):
        each.seed(11)
        np.testing.assert_array_equal(each.reset(), expected)
    rng, seen = np.random.default_rng(0), set()
    for _ in range(120):
        actions = draw(env, rng)
        rows, rewards, dones, infos = env.step(actions)
        *results, sparse_infos = sparse.step(actions)
        expected, paid, terminations, truncations, columns = twin.step(actions)
        np.testing.assert_equal(results, [rows, rewards, dones])
        np.testing.assert_array_equal(rows, expected)
        np.testing.assert_array_equal(rewards, paid.astype(np.float32))
        np.testing.assert_array_equal(dones, terminations | truncations)
        for slot, info in enumerate(infos):
            np.testing.assert_equal(sparse_infos[slot], info if dones[slot] else {})
            assert info.pop("TimeLimit.truncated") == truncations[slot]
            last = columns["final_info"] if dones[slot] else columns
            assert ("terminal_observation" in info) == dones[slot]
            if dones[slot]:
                final = info.pop("terminal_observation")
                np.testing.assert_array_equal(final, columns["final_obs"][slot])
            assert info == {name: last[name][slot] for name in info}
        seen |= set(truncations[dones].tolist())
        spoil(sparse_infos)  # does not show in later steps
    assert seen == ends


@PER_AGENT
def test_options_are_used_once(per_agent: bool) -> None:
    """Every flock has its own: a start, or the episode with which its schedule begins."""
    scenario = small_flock(angular_noise=0.5)
    env = vec_env(scenario, FLOCKS, per_agent=per_agent)
    singles = [fe.parallel_env(scenario) if per_agent else fe.FlockEscapeEnv(scenario) for _ in range(FLOCKS)]
    rows = env.num_envs // FLOCKS
    options = [{"episode": 4}, {"initial_positions": np.arange(10.0).reshape(5, 2)}, {"episode": 2}]

    def reset(seeds: Any = (None,) * FLOCKS, options: Any = (None,) * FLOCKS) -> np.ndarray:
        """Return the rows of all flocks after resets of single environments."""
        calls = zip(singles, seeds, options, strict=True)
        starts = [single.reset(seed=seed, options=given)[0] for single, seed, given in calls]
        return np.concatenate([[*rows.values()] if per_agent else [rows] for rows in starts])

    assert list(env.seed(1)) == [1 + slot // rows for slot in range(env.num_envs)]
    env.set_options([each for each in options for _ in range(rows)])
    np.testing.assert_array_equal(env.reset(), reset([1, 2, 3], options))
    for _ in range(3):
        observations, *_ = env.step(np.zeros((env.num_envs, 1), np.float32))
    np.testing.assert_array_equal(observations, reset())  # the next episodes
    env.seed(1)
    np.testing.assert_array_equal(env.reset(), reset([1, 2, 3]))


@PER_AGENT
def test_a_refused_reset_leaves_no_trace(per_agent: bool) -> None:
    """The last flock's options are bad, so those before it are not reset either."""
    env, twin = (vec_env(small_flock(), 2, per_agent=per_agent) for _ in range(2))
    for each in (env, twin):
        each.seed(3)
        each.reset()
        each.seed(8)
    with pytest.raises(fe.InputError, match="seed of the last flock"):
        env.seed(2**64 - 1)
    env.set_options([{}] * (env.num_envs // 2) + [{"episode": -1}] * (env.num_envs // 2))
    with pytest.raises(fe.InputError, match=r"^options\['episode'\]: "):
        env.reset()
    env.set_options()
    actions = draw(env, np.random.default_rng(0))
    np.testing.assert_equal(env.step(actions), twin.step(actions))
    np.testing.assert_array_equal(env.reset(), twin.reset())


@PER_AGENT
def test_attributes_and_methods(per_agent: bool) -> None:
    env = vec_env(small_flock(), FLOCKS, per_agent=per_agent)
    assert env.get_attr("scenario") == [small_flock()] * env.num_envs
    assert env.get_attr("render_mode", indices=[0, 2]) == [None, None]
    assert env.get_attr("scenario", indices=1) == [small_flock()]
    (spec,) = env.get_attr("spec", indices=0)
    assert spec.id == ("flockesc/FlockAgents-v1" if per_agent else "flockesc/FlockEscape-v1")
    assert spec.max_episode_steps == env.get_attr("policy_spec")[0].num_actions
    env.set_attr("note", 7)
    assert env.get_attr("note", indices=0) == [7]
    assert env.has_attr("note")
    assert not env.has_attr("nothing")
    with pytest.raises(ValueError, match="indices"):
        env.set_attr("note", 8, indices=0)
    assert env.get_attr("note", indices=0) == [7]
    assert env.env_method("get_attr", "note", indices=[0, 1]) == [[7] * env.num_envs] * 2
    assert env.env_is_wrapped(Wrapper) == [False] * env.num_envs
    assert env.env_is_wrapped(Wrapper, indices=[1]) == [False]
    env.close()
    env.close()


@pytest.mark.parametrize("scenario", ["paper-line", fe.LineScenario()])
def test_a_slot_per_line(scenario: Any) -> None:
    env = vec_env(scenario, 2, reward="terminal")
    assert [spec.id for spec in env.get_attr("spec")] == ["flockesc/LineEscape-v1"] * 2
    VecNormalize(VecMonitor(env)).reset()
    with pytest.raises(fe.InputError, match="per_agent"):
        vec_env(scenario, per_agent=True)


@pytest.mark.parametrize("learning_rate", [0.0, 0.1])
def test_the_callback_plays_flocks_and_keeps_the_best_model(learning_rate: float, tmp_path: Path) -> None:
    settings = {"n_steps": 10, "batch_size": 50, "seed": 0, "device": "cpu", "learning_rate": learning_rate}
    hunted = small_flock(predators=(Learned(),))
    scenarios = [hunted, hunted.replace(num_steps=9)]
    options = {**EVERY_STEP, "objective": "min_min_distance", "max_range": 40.0, "predator_policy": Pursue()}
    callback = FlockEvalCallback(10, 3, best_model_save_path=tmp_path / "best")
    models = []
    for chosen in (None, callback):
        env = vec_env(scenarios, 2, per_agent=True, **options)
        model = PPO("MlpPolicy", VecNormalize(env), tensorboard_log=str(tmp_path), **settings)
        models.append(model.learn(200, callback=chosen))
    weights = [[part.detach().numpy() for part in model.policy.parameters()] for model in models]
    np.testing.assert_equal(*weights)  # the callback does not change the training
    logged = EventAccumulator(str(tmp_path / "PPO_2")).Reload()
    values = [event.value for event in logged.Scalars("eval/min_min_distance")]
    steps = [event.step for event in logged.Scalars("eval/min_min_distance")]
    assert steps == [0, 100, 200, 200]  # before the training, and every 100 actions
    assert callback.num_episodes == logged.Scalars("eval/episodes")[-1].value == 4 * 3 * 2
    assert callback.best_objective == pytest.approx(max(values))
    statistics = VecNormalize.load(str(tmp_path / "best" / "vecnormalize.pkl"), env)
    best = PPO.load(tmp_path / "best" / "best_model.zip", device="cpu")
    assert best.num_timesteps == steps[int(np.argmax(values))]
    policy = fe.SB3Policy(best, vec_normalize=statistics)
    played = [fe.rollout(scenario, policy, TUNING[:3], **options) for scenario in scenarios]
    assert np.mean([episodes.min_min_distance for episodes in played]) == callback.best_objective


@pytest.mark.parametrize("wrap", [lambda env: env, lambda env: VecNormalize(env, clip_obs=np.inf)])
def test_a_model_becomes_a_run_in_one_line(wrap: Any, tmp_path: Path, cli: Cli) -> None:
    scenario, folder = small_flock(), tmp_path / "best"
    callback = FlockEvalCallback(100, 1, best_model_save_path=folder)
    env = wrap(vec_env(scenario, per_agent=True, max_range=40.0))
    model = PPO("MlpPolicy", env, n_steps=10, batch_size=50, device="cpu").learn(10, callback=callback)
    fe.save_policy(model, tmp_path / "mine.npz")
    saved = fe.load_policy(tmp_path / "mine.npz")
    assert (saved.name, saved.scenario, (saved.options or {})["max_range"]) == ("PPO", scenario, 40.0)
    best = PPO.load(folder / "best_model.zip")
    statistics = (
        VecNormalize.load(str(folder / "vecnormalize.pkl"), env.venv) if env != env.unwrapped else None
    )
    expected = fe.simulate(policy=fe.SB3Policy(best, vec_normalize=statistics), scenario=scenario, seed=7)
    for path in (folder, folder / "best_model.zip"):
        ran = cli("simulate", f"PPO:{path}", "--seed", 7, "--json")
        assert ran.json()["min_mean_distance"] == expected.mean_distance.min()
        assert ("vecnormalize.pkl normalizes" in ran.err) == (statistics is not None)
    assert cli("watch", f"PPO:{folder}", tmp_path / "mine.npz", "--output", tmp_path / "a.html").code == 0
    assert "such as PPO:" in cli("watch", folder).err


def test_the_callback_refuses_other_environments() -> None:
    model = A2C("MlpPolicy", DummyVecEnv([lambda: fe.FlockEscapeEnv(small_flock())]), device="cpu")
    with pytest.raises(fe.InputError, match=r"model.env: expected an environment of Task.vec_env"):
        model.learn(5, callback=FlockEvalCallback(5))
