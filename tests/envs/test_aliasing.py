"""Aliasing: changing arrays and dicts that an environment got or returned changes nothing inside it."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from envs import ADAPTERS, adapters, draw, has_ended, plain, start, step
from same import spoil
from stable_baselines3.common.vec_env import VecEnv

STEPS = 25
"""More steps than an episode has, so that environments with autoreset reset."""


def attributes(env: Any) -> list[Any]:
    """Return the public attributes of an environment."""
    names = ("metadata", "action_space", "observation_space", "state_space", "action_spaces", "policy_spec")
    names += ("single_action_space", "single_observation_space", "observation_spaces", "predator_policy_spec")
    shown = [getattr(env, name, None) for name in names]
    actions = getattr(getattr(env, "policy_spec", None), "actions", None)
    return [*shown, env.options, env.scenario, getattr(actions, "grid", None)]


def spoilt(make: Callable[[], Any]) -> Any:
    """Return an environment whose attributes were changed in place before its first reset."""
    env = make()
    for attribute in attributes(env):
        if not callable(attribute):
            spoil(attribute)
    return env


@adapters(lambda adapter: adapter.has_states and not adapter.reuses_buffers)
def test_results_and_actions(make: Callable[[], Any]) -> None:
    metadata = copy.deepcopy(make().metadata)
    env, twin = spoilt(make), make()
    assert twin.metadata == metadata
    results = start(env, 3)
    np.testing.assert_equal(results, start(twin, 3))
    spoil((results, getattr(env, "reset_infos", None)))
    is_drawn = getattr(twin, "render_mode", None) == "rgb_array"
    looks = ["render"] * is_drawn + ["state"] * hasattr(twin, "state")
    rng = np.random.default_rng(0)
    for _ in range(STEPS):
        actions = draw(twin, rng)
        mine = copy.deepcopy(actions)
        if isinstance(env, VecEnv):
            env.step_async(mine)
            spoil(mine)
            results = env.step_wait()
        else:
            results = step(env, mine)
            spoil(mine)
        expected = step(twin, actions)
        np.testing.assert_equal(plain(results), plain(expected))
        for look in looks:
            np.testing.assert_equal(getattr(env, look)(), getattr(twin, look)())
            spoil(getattr(env, look)())
            np.testing.assert_equal(getattr(env, look)(), getattr(twin, look)())
        spoil(results)
        if has_ended(twin, expected):
            np.testing.assert_equal(results := start(env), start(twin))
            spoil(results)


@pytest.mark.parametrize("name", [name for name in ADAPTERS if name.startswith("parallel")])
def test_parallel_arrays(name: str) -> None:
    env, twin = spoilt(ADAPTERS[name].make), ADAPTERS[name].make()
    results = env.reset_array(seed=3)
    np.testing.assert_equal(results, twin.reset_array(seed=3))
    spoil(results)
    hunters = [agent for agent in twin.possible_agents if agent.startswith("predator")]
    rng = np.random.default_rng(0)
    while twin.agents:
        actions = rng.uniform(-1, 1, (5, 1)).astype(np.float32)
        steering = rng.uniform(-0.5, 0.5, (len(hunters), 2)) if hunters else None
        mine = copy.deepcopy((actions, steering))
        results = env.step_array(*mine)
        spoil(mine)
        np.testing.assert_equal(results, twin.step_array(actions, steering))
        spoil(results)
