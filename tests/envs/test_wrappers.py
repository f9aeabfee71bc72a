"""What others put around an environment: ids, wrappers, and the loops of stable-baselines3."""

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import sb3_contrib
import sb3_contrib.common.wrappers
import stable_baselines3
from envs import draw
from gymnasium import wrappers
from gymnasium.envs.registration import EnvSpec
from option_table import IDS, small_flock
from stable_baselines3.common.callbacks import CheckpointCallback, EvalCallback
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

import flockesc_env
from flockesc_env.taskset import tasks
from flockesc_env.taskset.registration import FIXED

FLOCK, LINE = small_flock(), flockesc_env.LineScenario(num_agents=20, max_steps=10)


def made(make: Callable[[str], Any], name: str) -> list[Any]:
    """Return the environment, or those of the calls that the error names."""
    try:
        return [make(name)]
    except flockesc_env.InputError as error:
        text = str(error)
    calls = re.findall(r"(?:gymnasium|flockesc_env)\.[^ ]+\(.*?\)", text)
    assert len(calls) == 2 or (make is gymnasium.make_vec and "num_agents = 300" in text)
    return [eval(call, {**globals(), "flocks": 2}) for call in calls]  # noqa: S307, our own text


@pytest.mark.parametrize("name", [name for name in gymnasium.registry if name.startswith("flockesc/")])
def test_an_id_makes_an_environment_or_says_what_to_type(name: str) -> None:
    assert EnvSpec.from_json(gymnasium.spec(name).to_json()) == gymnasium.spec(name)
    for env in (*made(gymnasium.make, name), *made(gymnasium.make_vec, name)):
        env.reset(seed=0)
        env.step(draw(env, np.random.default_rng(0)))


@pytest.mark.parametrize("name", IDS)
def test_the_limit_of_an_id_is_that_of_its_scenario(name: str) -> None:
    is_line, is_single = "Line" in name, "Agents" not in name
    scenario = flockesc_env.LineScenario(max_steps=9) if is_line else small_flock(num_steps=9)
    options: dict[str, Any] = {"scenario": scenario, "steps_per_action": 2}
    for mode in ("sync", None) if is_single else (None,):
        slots = gymnasium.make_vec(name, num_envs=5, vectorization_mode=mode, **options)
        specs = [env.spec for env in getattr(slots, "envs", [slots])]
        assert {spec.max_episode_steps for spec in specs} == {5}
    for limit in (2, None) if is_single else ():
        env: Any = gymnasium.make(name, max_episode_steps=limit, **options)
        env.reset(seed=0)
        ends = [env.step(env.action_space.high)[2:4] for _ in range(limit or 5)]
        assert [any(end) for end in ends] == [False] * (len(ends) - 1) + [True]


@pytest.mark.parametrize("task", tasks.values(), ids=tasks)
def test_an_id_of_a_task_makes_its_environment(task: Any) -> None:
    """Its number of actions is in the spec; what would change the task is refused."""
    count: Any = {"num_envs": task.policy_spec.rows} if task.per_agent else {}
    make: Any = gymnasium.make_vec if task.per_agent else gymnasium.make
    for env in (make(task.id, **count).unwrapped, task.vec_env(2, learner=None)):
        spec, scenario, options = (
            env.get_attr(name)[0] if hasattr(env, "get_attr") else getattr(env, name)
            for name in ("spec", "scenario", "options")
        )
        assert spec.id == task.id
        assert spec.max_episode_steps == task.policy_spec.num_actions
        assert gymnasium.spec(task.id).max_episode_steps == spec.max_episode_steps
        assert scenario == task.scenario
        assert options == dataclasses.replace(options, **task.options, reward=task.reward)
    for name in FIXED:
        with pytest.raises(
            flockesc_env.InputError, match=rf"^{name}: .*flockesc/(FlockAgents|FlockEscape|LineEscape)-v1"
        ):
            make(task.id, **count, **{name: 1})
    make(task.id, **count, reward="terminal", action_mode="discrete")


WRAPPERS: dict[str, dict[str, Any]] = {
    "ClipAction": {},
    "FlattenObservation": {},
    "RescaleAction": {"min_action": np.float32(0), "max_action": np.float32(1)},
    "RescaleObservation": {"min_obs": np.float32(0), "max_obs": np.float32(1)},
    "NormalizeObservation": {},
    "NormalizeReward": {},
    "RecordEpisodeStatistics": {},
    "ClipReward": {"min_reward": -0.1},
    "TimeAwareObservation": {},
    "FrameStackObservation": {"stack_size": 3},
    "DelayObservation": {"delay": 2},
    "TimeFeatureWrapper": {},  # assigns to the inner environment
}
MAKERS: dict[str, Callable[[], Any]] = {
    "FlockEscape": lambda: gymnasium.make("flockesc/FlockEscape-v1", scenario=FLOCK),
    "LineEscape": lambda: gymnasium.make("flockesc/LineEscape-v1", scenario=LINE),
    "task": lambda: gymnasium.make("flockesc/one-range-v1"),
    "vector": lambda: gymnasium.make_vec("flockesc/FlockEscape-v1", 2, scenario=FLOCK),
    "vector of agents": lambda: gymnasium.make_vec("flockesc/FlockAgents-v1", 10, scenario=FLOCK),
}


@pytest.mark.parametrize(
    ("kind", "wrapper"),
    [
        (kind, wrapper)
        for kind in MAKERS
        for wrapper in WRAPPERS
        if hasattr(wrappers.vector, wrapper) or "vector" not in kind
    ],
)
def test_wrappers_of_gymnasium(kind: str, wrapper: str) -> None:
    """An episode in a wrapper ends like one without, and its observations lie in the wrapper's space."""
    inner = MAKERS[kind]()
    library = wrappers.vector if "vector" in kind else wrappers
    if wrapper == "TimeFeatureWrapper":
        library, inner = sb3_contrib.common.wrappers, inner.unwrapped
    env = getattr(library, wrapper)(inner, **WRAPPERS[wrapper])
    env.action_space.seed(0)
    observation, _ = env.reset(seed=0)
    most = inner.spec.max_episode_steps
    for count in range(1, most + 1):
        assert observation in env.observation_space
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert np.isfinite(reward).all()
        ended = np.all(terminated | truncated)
        assert np.any(terminated | truncated) == ended == (count == most or (kind == "LineEscape" and ended))
        if ended:
            break


@pytest.mark.parametrize("name", ["one-range", "per-agent-visible", "line"])
def test_the_loop_of_stable_baselines3(name: str, tmp_path: Path) -> None:
    """Train on a task with wrappers and callbacks, save, load, act alike, learn on."""
    task = tasks[name]
    env, judge = (VecNormalize(VecMonitor(task.vec_env(num_flocks=count))) for count in (2, 1))
    model = stable_baselines3.A2C("MlpPolicy", env, device="cpu", seed=0)
    checkpoints = CheckpointCallback(10, str(tmp_path), save_vecnormalize=True)
    evaluations = EvalCallback(judge, n_eval_episodes=1, eval_freq=10, best_model_save_path=str(tmp_path))
    flocks = task.eval_callback(num_flocks=2, best_model_save_path=tmp_path / "flocks")
    steps = 10 * env.num_envs
    model.learn(steps, callback=[checkpoints, evaluations, flocks]).save(tmp_path / "last")
    assert np.isfinite(evaluations.best_mean_reward)
    assert flocks.num_episodes == 4  # at the start and at the end
    models = {"best_model", "last", f"rl_model_{steps}_steps"}
    assert {path.stem for path in tmp_path.rglob("*.zip")} == models
    rows, last = judge.reset(), stable_baselines3.A2C.load(tmp_path / "last", device="cpu")
    np.testing.assert_array_equal(*(each.predict(rows, deterministic=True)[0] for each in (model, last)))
    file = tmp_path / f"rl_model_vecnormalize_{steps}_steps.pkl"
    env = VecNormalize.load(str(file), VecMonitor(task.vec_env(2)))
    model = stable_baselines3.A2C.load(tmp_path / f"rl_model_{steps}_steps", env=env, device="cpu")
    assert model.learn(steps, reset_num_timesteps=False).num_timesteps == 2 * steps
