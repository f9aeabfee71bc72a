"""The contract of stable-baselines3's VecEnv for FlockVecEnv and AgentVecEnv."""

from __future__ import annotations

import copy
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from gymnasium import Wrapper
from option_table import AGENT_OPTIONS, FLOCK_OPTIONS, label, small_flock
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from flockesc_env import FlockEscapeEnv, parallel_env
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

FLOCKS = 3
ENVS = pytest.mark.parametrize("make", [FlockVecEnv, AgentVecEnv])


def sample(env: VecEnv, rng: np.random.Generator) -> np.ndarray:
    if env.action_space.shape == ():
        return rng.integers(0, env.action_space.n, env.num_envs)
    low, high = env.action_space.low[0], env.action_space.high[0]
    return rng.uniform(low, high, (env.num_envs, 1)).astype(np.float32)


def assert_episodes(env: VecEnv, steps_per_action: int) -> None:
    """Play into the second episode and check all that SB3 relies on."""
    rng = np.random.default_rng(0)
    length = -(-env.get_attr("scenario")[0].num_steps // steps_per_action)
    env.seed(0)
    observations = [env.reset()]
    assert len(env.reset_infos) == env.num_envs
    seen_infos: list[dict[str, Any]] = []
    for step in range(1, length + 3):
        observation, rewards, dones, infos = env.step(sample(env, rng))
        is_last = step % length == 0
        assert observation.shape == (env.num_envs, *env.observation_space.shape)
        assert observation.dtype == rewards.dtype == np.float32
        assert rewards.shape == dones.shape == (env.num_envs,)
        assert dones.dtype == np.bool
        assert (dones == is_last).all()
        assert type(infos) is list
        assert len(infos) == env.num_envs
        for info in infos:
            assert info["TimeLimit.truncated"] is is_last
            assert ("terminal_observation" in info) is is_last
            if is_last:
                assert env.observation_space.contains(info["terminal_observation"])
        assert all(env.observation_space.contains(row) for row in observation)
        observations.append(observation)
        seen_infos += infos
    assert len({id(info) for info in seen_infos}) == len(seen_infos)
    assert not any(np.shares_memory(a, b) for a, b in pairwise(observations))


@pytest.mark.parametrize("options", FLOCK_OPTIONS, ids=label)
def test_flock_slots(options: dict[str, Any]) -> None:
    assert_episodes(FlockVecEnv(FLOCKS, small_flock(), **options), options["steps_per_action"])


@pytest.mark.parametrize("options", AGENT_OPTIONS, ids=label)
def test_agent_slots(options: dict[str, Any]) -> None:
    env = AgentVecEnv(FLOCKS, small_flock(3), **options)
    assert env.num_envs == FLOCKS * 5
    assert_episodes(env, options["steps_per_action"])


def test_flock_slots_equal_single_environments() -> None:
    """Three episodes, including terminal observations and observations after a reset."""
    scenario = small_flock()
    env, twins = FlockVecEnv(FLOCKS, scenario), [FlockEscapeEnv(scenario) for _ in range(FLOCKS)]
    env.seed(11)
    start = env.reset()
    for slot, twin in enumerate(twins):
        observation, info = twin.reset(seed=11 + slot)
        np.testing.assert_array_equal(start[slot], observation)
        assert env.reset_infos[slot] == {**info, "TimeLimit.truncated": False}
    rng = np.random.default_rng(0)
    for _ in range(3 * scenario.num_steps):
        actions = sample(env, rng)
        observations, rewards, dones, infos = env.step(actions)
        for slot, twin in enumerate(twins):
            observation, reward, _, truncated, info = twin.step(actions[slot])
            assert rewards[slot] == np.float32(reward)
            assert dones[slot] == truncated
            expected = {**info, "TimeLimit.truncated": truncated}
            if truncated:
                np.testing.assert_array_equal(infos[slot].pop("terminal_observation"), observation)
                observation, _ = twin.reset()
            assert infos[slot] == expected
            np.testing.assert_array_equal(observations[slot], observation)


@pytest.mark.parametrize("reward", ["running_minimum", "individual_distance"])
def test_agent_slots_equal_parallel_environments(reward: str) -> None:
    scenario = small_flock()
    n = scenario.num_agents
    env = AgentVecEnv(FLOCKS, scenario, reward=reward)
    twins = [parallel_env(scenario, reward=reward) for _ in range(FLOCKS)]
    env.seed(11)
    start = env.reset()
    for flock, twin in enumerate(twins):
        observations, _ = twin.reset(seed=11 + flock)
        np.testing.assert_array_equal(start[flock * n : (flock + 1) * n], list(observations.values()))
    rng = np.random.default_rng(0)
    for _ in range(2 * scenario.num_steps):
        actions = sample(env, rng)
        rows, rewards, dones, infos = env.step(actions)
        for flock, twin in enumerate(twins):
            slots = slice(flock * n, (flock + 1) * n)
            named = dict(zip(twin.possible_agents, actions[slots], strict=True))
            observations, paid, _, truncations, own_infos = twin.step(named)
            np.testing.assert_array_equal(rewards[slots], np.float32(list(paid.values())))
            assert dones[slots].tolist() == list(truncations.values())
            for info, own in zip(infos[slots], own_infos.values(), strict=True):
                assert own.items() <= info.items()
            if not twin.agents:
                last = [info["terminal_observation"] for info in infos[slots]]
                np.testing.assert_array_equal(last, list(observations.values()))
                observations, _ = twin.reset()
            np.testing.assert_array_equal(rows[slots], list(observations.values()))


@ENVS
def test_buffers_are_never_reused(make: type[VecEnv]) -> None:
    """SB3 keeps observations across the next step and edits rewards in place."""
    env, twin = make(FLOCKS, small_flock()), make(FLOCKS, small_flock())
    for each in (env, twin):
        each.seed(3)
    np.testing.assert_array_equal(kept := env.reset(), twin.reset())
    rng = np.random.default_rng(0)
    for _ in range(2 * 10 + 1):
        actions = sample(env, rng)
        before = kept.copy()
        results = env.step(actions)
        np.testing.assert_array_equal(kept, before)
        np.testing.assert_equal(results, twin.step(actions.copy()))
        kept[:] = np.nan
        results[1][:] = np.nan
        results[2][:] = True
        for info in results[3]:
            info.get("terminal_observation", np.empty(1))[:] = np.nan
            info.clear()
        actions[:] = 0
        kept = results[0]


@ENVS
def test_infos_at_the_end_only(make: type[VecEnv]) -> None:
    """Infos of running slots are one new empty dict; ended slots have the same infos as otherwise."""
    scenarios = [small_flock(num_steps=3), small_flock(num_steps=4, capture_radius=6.0)]
    full = VecMonitor(VecNormalize(make(2, scenarios)), info_keywords=("min_mean_distance",))
    sparse = VecMonitor(VecNormalize(make(2, scenarios, infos="end")), info_keywords=("min_mean_distance",))
    rng = np.random.default_rng(0)
    for env in (full, sparse):
        env.seed(0)
        env.reset()
    for _ in range(6):
        actions = sample(full, rng)
        (*expected, all_infos), (*given, infos) = full.step(actions), sparse.step(actions)
        for one, other in zip(expected, given, strict=True):
            np.testing.assert_array_equal(one, other)
        own = [id(info) for info, is_done in zip(infos, given[-1], strict=True) if is_done]
        assert len(set(own)) == len(own)
        for is_done, info, whole in zip(given[-1], infos, all_infos, strict=True):
            if is_done:
                for one in (info, whole):
                    del one["episode"]["t"]  # a time on the clock
                np.testing.assert_equal(info, whole)
            else:
                assert info == {}
        for info in infos:
            info["written"] = True  # does not show in later steps


@ENVS
def test_seeds_are_used_once(make: type[VecEnv]) -> None:
    env, twin = make(FLOCKS, small_flock()), make(FLOCKS, small_flock())
    rows = env.num_envs // FLOCKS
    assert list(env.seed(5)) == [5 + slot // rows for slot in range(env.num_envs)]
    first, second, third = env.reset(), env.reset(), env.reset()
    assert not np.array_equal(first, second)
    assert not np.array_equal(second, third)
    twin.seed(5)
    for expected in (first, second, third):
        np.testing.assert_array_equal(twin.reset(), expected)
    env.seed(6)
    np.testing.assert_array_equal(env.reset()[:rows], first[rows : 2 * rows])


@ENVS
def test_seed_none_draws_new_seeds(make: type[VecEnv]) -> None:
    env = make(1, small_flock())
    drawn = {env.seed()[0] for _ in range(5)}
    assert len(drawn) == 5


@ENVS
def test_options_are_used_once(make: type[VecEnv]) -> None:
    scenario = small_flock()
    start = np.arange(10.0).reshape(5, 2)
    env, twin = make(FLOCKS, scenario), make(FLOCKS, scenario)
    single = parallel_env(scenario) if make is AgentVecEnv else FlockEscapeEnv(scenario)
    env.seed(1)
    env.set_options({"initial_positions": start})
    given = env.reset()
    rows = env.num_envs // FLOCKS
    expected, _ = single.reset(seed=2, options={"initial_positions": start})
    expected = np.array(list(expected.values())) if make is AgentVecEnv else expected[np.newaxis]
    np.testing.assert_array_equal(given[rows : 2 * rows], expected)
    env.seed(1)
    twin.seed(1)
    np.testing.assert_array_equal(env.reset(), twin.reset())


@ENVS
def test_attributes_and_methods(make: type[VecEnv]) -> None:
    env = make(FLOCKS, small_flock())
    assert env.get_attr("scenario") == [small_flock()] * env.num_envs
    assert env.get_attr("render_mode", indices=[0, 2]) == [None, None]
    assert env.get_attr("scenario", indices=1) == [small_flock()]
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


@ENVS
def test_wrappers_of_sb3_work(make: type[VecEnv]) -> None:
    env = VecNormalize(VecMonitor(make(FLOCKS, small_flock())))
    env.seed(0)
    env.reset()
    rng = np.random.default_rng(0)
    episodes = []
    for _ in range(10):
        _, _, _, infos = env.step(sample(env, rng))
        episodes += [info["episode"] for info in infos if "episode" in info]
    assert [episode["l"] for episode in episodes] == [10] * env.num_envs


@ENVS
def test_deep_copy_is_independent(make: type[VecEnv]) -> None:
    env = make(FLOCKS, small_flock())
    env.seed(0)
    env.reset()
    rng = np.random.default_rng(0)
    env.step(sample(env, rng))
    twin = copy.deepcopy(env)
    actions = [sample(env, rng) for _ in range(25)]
    results = [env.step(action) for action in actions]
    np.testing.assert_equal([twin.step(action) for action in actions], results)
