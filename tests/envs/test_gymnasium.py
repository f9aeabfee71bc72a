"""The Gymnasium contract for whole episodes, over all triples of options."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from objective_values import INFO_KEYS
from option_table import DIMENSIONS, FLOCK, LINE, every_option, small_flock

from flockesc_env import FlockEscapeEnv, LineEscapeEnv, LineScenario

Options = dict[str, Any]


def play(env: gymnasium.Env[Any, Any], seed: int) -> list[tuple[Any, ...]]:
    """Return all results of an episode under random actions."""
    env.action_space.seed(seed)
    steps: list[tuple[Any, ...]] = [env.reset(seed=seed)]
    has_ended = False
    while not has_ended:
        steps.append(env.step(env.action_space.sample()))
        has_ended = steps[-1][2] or steps[-1][3]
    return steps


def assert_contract(env: gymnasium.Env[Any, Any], steps: list[tuple[Any, ...]]) -> None:
    observations = [step[0] for step in steps]
    assert all(env.observation_space.contains(observation) for observation in observations)
    assert all(np.isfinite(observation).all() for observation in observations)
    assert len({id(observation) for observation in observations}) == len(observations)
    assert len({id(step[-1]) for step in steps}) == len(steps)
    for _, reward, terminated, truncated, info in steps[1:]:
        assert type(reward) is float
        assert type(terminated) is bool
        assert type(truncated) is bool
        assert "episode" not in info
        assert all(type(value) in {float, int} for value in info.values())


@every_option(FLOCK, dimension=DIMENSIONS)
def test_flock_episode(options: Options, dimension: int) -> None:
    env = FlockEscapeEnv(small_flock(dimension), **options)
    steps = play(env, 3)
    assert_contract(env, steps)
    assert len(steps) - 1 == -(-env.scenario.num_steps // options["steps_per_action"])
    assert not any(step[2] for step in steps[1:])
    assert [step[3] for step in steps[1:]] == [False] * (len(steps) - 2) + [True]
    assert all(set(step[-1]) == INFO_KEYS for step in steps)
    np.testing.assert_equal(play(env, 3), steps)


@every_option(LINE, escape_force=("constant", "linear", "linear_as_printed"))
def test_line_episode(options: Options, escape_force: Any) -> None:
    env = LineEscapeEnv(LineScenario(num_agents=20, max_steps=15, escape_force=escape_force), **options)
    steps = play(env, 3)
    assert_contract(env, steps)
    np.testing.assert_equal(play(env, 3), steps)


def test_line_terminates_when_steady_and_is_truncated_otherwise() -> None:
    env = LineEscapeEnv(LineScenario(), action_mode="range")
    env.reset(seed=0)
    flags = [(False, False)]
    while not any(flags[-1]):
        observation, _, *ended, _ = env.step(np.array([0.1], np.float32))
        flags.append(tuple(ended))
    assert flags[-1] == (True, False)
    assert len(flags) < 100
    # The last step moved no agent: a steady state is never announced early.
    assert observation[2] == np.float32(0.1)
    short = LineEscapeEnv(LineScenario(max_steps=2), action_mode="range")
    short.reset(seed=0)
    assert short.step(np.array([0.1], np.float32))[2:4] == (False, False)
    assert short.step(np.array([0.1], np.float32))[2:4] == (False, True)


def test_discrete_grid() -> None:
    grid = (0.0, 7.5, 30.0)
    env = FlockEscapeEnv(small_flock(), action_mode="discrete", range_grid=grid)
    assert env.action_space == gymnasium.spaces.Discrete(3)
    env.reset(seed=0)
    assert [env.step(index)[-1]["interaction_range"] for index in range(3)] == list(grid)
    default = FlockEscapeEnv(small_flock(), action_mode="discrete", min_range=10.0, max_range=50.0)
    default.reset(seed=0)
    assert [default.step(index)[-1]["interaction_range"] for index in (0, 1, 20)] == [10.0, 12.0, 50.0]


@pytest.mark.parametrize(
    ("mode", "forms"),
    [
        ("normalized", [np.array([0.5], np.float32), [0.5], (0.5,), np.array([0.5]), np.float16([0.5])]),
        ("range", [np.array([7], np.float32), [7], np.array([7], np.uint8), np.array([7, 9.0])[::2]]),
        ("discrete", [np.int64(3), 3, np.array(3), np.uint8(3), np.int32(3)]),
    ],
)
def test_forms_of_an_action(mode: str, forms: list[Any]) -> None:
    """Elements of the action space and equivalent plain numbers set the same range."""
    env = FlockEscapeEnv(small_flock(), action_mode=mode)
    assert env.action_space.contains(forms[0])
    played = []
    for form in forms:
        env.reset(seed=0)
        played.append(env.step(form))
    for step in played[1:]:
        np.testing.assert_equal(step, played[0])


@pytest.mark.parametrize("count_components", [False, True])
def test_components_are_counted_on_request(count_components: bool) -> None:
    env = FlockEscapeEnv(small_flock(), count_components=count_components)
    _, info = env.reset(seed=0)
    assert info.get("num_components") == (5 if count_components else None)
    *_, info = env.step(env.action_space.high)  # every agent hears every other one
    assert info.get("num_components") == (1 if count_components else None)
    assert set(info) == (INFO_KEYS | {"num_components"} if count_components else INFO_KEYS)
