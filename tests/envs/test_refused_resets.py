"""A reset that is refused leaves no trace: neither in the running episode nor in the seeds to come."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from option_table import small_flock

from flockesc_env import FlockEscapeEnv, LineEscapeEnv, LineScenario, parallel_env
from flockesc_env.common.errors import ArgumentError
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

FLOCK = small_flock()
SPOILT = np.zeros((5, 2))
SPOILT[3, 1] = np.nan

MAKERS: dict[str, Callable[[], Any]] = {
    "gymnasium": lambda: FlockEscapeEnv(FLOCK),
    "line": lambda: LineEscapeEnv(LineScenario(num_agents=5, max_steps=10)),
    "parallel": lambda: parallel_env(FLOCK),
    "flock slots": lambda: FlockVecEnv(2, FLOCK),
    "agent slots": lambda: AgentVecEnv(2, FLOCK),
}
EPISODES = [("episode", number, "options['episode']") for number in (-1, 2**64, 1.5, "2", [1])]
FLOCK_OPTIONS = [
    ("initial_positions", np.zeros((4, 2)), "initial_positions"),
    ("initial_positions", SPOILT, "initial_positions[3, 1]"),
    ("initial_positions", np.full((5, 2), 1e30), "initial_positions[0, 0]"),
    ("initial_velocities", np.zeros((5, 3)), "initial_velocities"),
    ("initial_velocities", SPOILT.astype(str), "initial_velocities"),
    ("predator_positions", np.zeros(2), "predator_positions"),
    ("predator_velocities", np.zeros((2, 2)), "predator_velocities"),
    *EPISODES,
]
LINE_OPTIONS = [
    ("initial_state", np.zeros(4), "initial_state"),
    ("initial_state", np.array([0, 0, np.inf, 0, 0]), "initial_state[2]"),
    ("initial_state", np.array([0, 0, 0, 1e30, 0]), "initial_state[3]"),
    *EPISODES,
]
UNKNOWN = ("positions", np.zeros((5, 2)), "options['positions']")


def cases(interface: str) -> list[tuple[str, Any, str]]:
    """Return options that an interface refuses: name, value and the field that the error names."""
    known = LINE_OPTIONS if interface == "line" else FLOCK_OPTIONS
    # PettingZoo asks that unknown options be ignored.
    return known if interface == "parallel" else [*known, UNKNOWN]


def start(env: Any, seed: int) -> Any:
    if hasattr(env, "num_envs"):
        env.seed(seed)
        return env.reset()
    return env.reset(seed=seed)


def step(env: Any) -> Any:
    action = np.array([0.5], np.float32)
    if hasattr(env, "num_envs"):
        return env.step(np.tile(action, (env.num_envs, 1)))
    return env.step(dict.fromkeys(env.agents, action) if hasattr(env, "agents") else action)


def refuse(env: Any, options: dict[str, Any], seed: int | None) -> str:
    """Reset with bad options and return the name of what was refused."""
    if not hasattr(env, "num_envs"):
        with pytest.raises(ArgumentError) as caught:
            env.reset(seed=seed, options=options)
        return caught.value.field
    if seed is not None:
        env.seed(seed)
    # The last flock's options are bad: those before it must not have been reset either.
    env.set_options([{}] * (env.num_envs // 2) + [options] * (env.num_envs // 2))
    with pytest.raises(ArgumentError) as caught:
        env.reset()
    env.set_options()
    return caught.value.field


def playing_twins(interface: str) -> tuple[Any, Any]:
    env, twin = MAKERS[interface](), MAKERS[interface]()
    for each in (env, twin):
        start(each, 3)
        step(each)
    return env, twin


@pytest.mark.parametrize("interface", MAKERS)
@pytest.mark.parametrize("seed", [None, 17])
def test_episode_goes_on_and_seeds_to_come_stay(interface: str, seed: int | None) -> None:
    """SB3's ``seed`` is a separate call and stays in force; elsewhere it is part of the refused call."""
    env, twin = playing_twins(interface)
    for name, value, field in cases(interface):
        assert refuse(env, {name: value}, seed) == field
        np.testing.assert_equal(step(env), step(twin))
        assert refuse(env, {name: value}, seed) == field
        if hasattr(twin, "num_envs") and seed is not None:
            twin.seed(seed)
        np.testing.assert_equal(env.reset(), twin.reset())


@pytest.mark.parametrize("interface", ["gymnasium", "line", "parallel"])
@pytest.mark.parametrize("seed", [-1, 1.5, 2**64, "a"])
def test_bad_seed(interface: str, seed: Any) -> None:
    env, twin = playing_twins(interface)
    with pytest.raises(ArgumentError):
        env.reset(seed=seed)
    np.testing.assert_equal(step(env), step(twin))
    np.testing.assert_equal(env.reset(), twin.reset())


@pytest.mark.parametrize("interface", ["flock slots", "agent slots"])
@pytest.mark.parametrize("seed", [-1, 1.5, 2**64, 2**64 - 1, "a"])
def test_bad_seed_of_slots(interface: str, seed: Any) -> None:
    """The second flock of two would have the seed after this one: the largest is too large."""
    env, twin = playing_twins(interface)
    with pytest.raises(ArgumentError):
        env.seed(seed)
    np.testing.assert_equal(step(env), step(twin))
    np.testing.assert_equal(env.reset(), twin.reset())


@pytest.mark.parametrize("interface", MAKERS)
def test_before_the_first_reset(interface: str) -> None:
    env, twin = MAKERS[interface](), MAKERS[interface]()
    options = {"initial_state": [0.0]} if interface == "line" else {"initial_positions": [0.0]}
    refuse(env, options, None)
    np.testing.assert_equal(start(env, 4), start(twin, 4))
