"""What callers do to what environments gave, or were given, changes nothing inside."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from option_table import small_flock
from spoiling import spoil

import flockesc_env
from flockesc_env import LineScenario
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

SCENARIO = small_flock()
LEARNED = flockesc_env.preset("learned-predator").replace(num_agents=5, num_steps=10, initial_side=30.0)
HUNTED = SCENARIO.replace(capture_radius=3.0, predator_range=5.0)
LINE = LineScenario(num_agents=5, max_steps=10)
STEPS = 15
"""More than an episode has, so that environments that reset themselves do so."""


def vector(mode: AutoresetMode, **options: Any) -> Any:
    return flockesc_env.FlockVectorEnv(3, SCENARIO, autoreset_mode=mode, **options)


GYMNASIUM: dict[str, Callable[[], Any]] = {
    "flock": lambda: flockesc_env.FlockEscapeEnv(SCENARIO, action_mode="range"),
    "flock, discrete": lambda: flockesc_env.FlockEscapeEnv(
        SCENARIO, action_mode="discrete", range_grid=[1.0, 5.0, 9.0]
    ),
    "flock in pictures": lambda: flockesc_env.FlockEscapeEnv(SCENARIO, render_mode="rgb_array"),
    "line": lambda: flockesc_env.LineEscapeEnv(LINE),
    "line in pictures": lambda: flockesc_env.LineEscapeEnv(LINE, render_mode="rgb_array"),
    "pursuit": lambda: flockesc_env.FlockPursuitEnv(SCENARIO),
}
VECTORS: dict[str, Callable[[], Any]] = {
    "vector, next step": lambda: vector(AutoresetMode.NEXT_STEP),
    "vector, same step": lambda: vector(AutoresetMode.SAME_STEP, action_mode="discrete"),
    "vector in pictures": lambda: vector(AutoresetMode.SAME_STEP, render_mode="rgb_array"),
}
PARALLEL: dict[str, Callable[[], Any]] = {
    "parallel": lambda: flockesc_env.parallel_env(SCENARIO),
    "parallel, hunted": lambda: flockesc_env.parallel_env(HUNTED, reward="individual_distance"),
    "parallel, learned predator": lambda: flockesc_env.parallel_env(LEARNED),
}
SB3: dict[str, Callable[[], Any]] = {
    "SB3, flocks": lambda: FlockVecEnv(2, SCENARIO),
    "SB3, agents": lambda: AgentVecEnv(2, HUNTED),
}


def attributes(env: Any) -> list[Any]:
    """Return what an environment shows of itself."""
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


@pytest.mark.parametrize("make", [*GYMNASIUM.values(), *VECTORS.values()], ids=[*GYMNASIUM, *VECTORS])
def test_gymnasium(make: Callable[[], Any]) -> None:
    env, twin, judge = spoilt(make), make(), make()
    options = [{"initial_positions": np.arange(10.0).reshape(5, 2)} for _ in range(2)]
    if isinstance(twin, flockesc_env.LineEscapeEnv):
        options = [{"initial_state": np.linspace(0, 1, 5)} for _ in range(2)]
    judge.action_space.seed(0)
    results = env.reset(seed=3, options=options[0])
    assert data_equivalence(results, twin.reset(seed=3, options=options[1]), exact=True)
    spoil((results, options[0]))
    for _ in range(STEPS):
        actions = np.array(judge.action_space.sample())
        mine = actions.copy()
        results = env.step(mine)
        spoil(mine)
        assert data_equivalence(results, twin.step(actions), exact=True)
        ends = np.any(results[2]) or np.any(results[3])
        if twin.render_mode:
            np.testing.assert_equal(env.render(), twin.render())
            spoil(env.render())
            np.testing.assert_equal(env.render(), twin.render())
        spoil(results)
        if ends and not hasattr(twin, "num_envs"):
            results = env.reset()
            assert data_equivalence(results, twin.reset(), exact=True)
            spoil(results)


@pytest.mark.parametrize("make", PARALLEL.values(), ids=PARALLEL)
def test_parallel(make: Callable[[], Any]) -> None:
    env, twin, judge = spoilt(make), make(), make()
    options = [{"initial_positions": np.arange(10.0).reshape(5, 2)} for _ in range(2)]
    results = env.reset(seed=3, options=options[0])
    np.testing.assert_equal(results, twin.reset(seed=3, options=options[1]))
    spoil((results, options[0]))
    for number, agent in enumerate(judge.possible_agents):
        judge.action_space(agent).seed(number)
    while twin.agents:
        actions = {agent: judge.action_space(agent).sample() for agent in twin.agents}
        mine = copy.deepcopy(actions)
        results = env.step(mine)
        spoil(mine)
        np.testing.assert_equal(results, twin.step(actions))
        np.testing.assert_equal(env.state(), twin.state())
        spoil((results, env.state()))
    assert env.agents == []


@pytest.mark.parametrize("make", PARALLEL.values(), ids=PARALLEL)
def test_parallel_arrays(make: Callable[[], Any]) -> None:
    env, twin, judge = spoilt(make), make(), make()
    results = env.reset_array(seed=3)
    np.testing.assert_equal(results, twin.reset_array(seed=3))
    spoil(results)
    hunters = [agent for agent in judge.possible_agents if agent.startswith("predator")]
    rng = np.random.default_rng(0)
    while twin.agents:
        actions = rng.uniform(-1, 1, (5, 1)).astype(np.float32)
        steering = rng.uniform(-0.5, 0.5, (len(hunters), 2)) if hunters else None
        mine = copy.deepcopy((actions, steering))
        results = env.step_array(*mine)
        spoil(mine)
        np.testing.assert_equal(results, twin.step_array(actions, steering))
        spoil(results)


@pytest.mark.parametrize("make", SB3.values(), ids=SB3)
def test_sb3(make: Callable[[], Any]) -> None:
    env, twin = spoilt(make), make()
    for each in (env, twin):
        each.seed(3)
    results = env.reset()
    np.testing.assert_equal(results, twin.reset())
    spoil((results, env.reset_infos))
    rng = np.random.default_rng(0)
    for _ in range(STEPS):
        actions = rng.uniform(-1, 1, (twin.num_envs, 1)).astype(np.float32)
        mine = actions.copy()
        env.step_async(mine)
        spoil(mine)
        results = env.step_wait()
        np.testing.assert_equal(results, twin.step(actions))
        spoil(results)


def test_what_one_environment_shows_is_not_another_ones() -> None:
    for make in (GYMNASIUM | VECTORS | PARALLEL | SB3).values():
        before = copy.deepcopy(make().metadata)
        spoilt(make)
        assert make().metadata == before
