"""Actions that no space contains are refused by name, and the episode goes on as if they had not come."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from envs import REMEMBERING, Weave, draw, has_ended, play
from envs import start as start_any
from gymnasium.error import ResetNeeded
from option_table import small_flock
from stable_baselines3.common.vec_env import VecEnv

from flockesc_env import (
    AgentVectorEnv,
    FlockEscapeEnv,
    FlockVectorEnv,
    LineEscapeEnv,
    LineScenario,
    env,
    parallel_env,
)
from flockesc_env.common.errors import ActionError, EpisodeError
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

FLOCK, LINE = small_flock(), LineScenario(num_agents=5, max_steps=10)
GOOD = {
    "normalized": np.array([0.5], np.float32),
    "range": np.array([0.5], np.float32),
    "discrete": np.int64(3),
}

SINGLE = {
    "flock": lambda mode: FlockEscapeEnv(FLOCK, action_mode=mode),
    "line": lambda mode: LineEscapeEnv(LINE, action_mode=mode),
}
STACKED = {
    "flock slots": lambda mode: FlockVecEnv(3, FLOCK, action_mode=mode),
    "agent slots": lambda mode: AgentVecEnv(3, FLOCK, action_mode=mode),
    "vector": lambda mode: FlockVectorEnv(3, FLOCK, action_mode=mode),
    "vector with a slot per agent": lambda mode: AgentVectorEnv(15, FLOCK, action_mode=mode),
    "agent array": lambda mode: AgentArray(mode),
}


class AgentArray:
    """The parallel environment's array interface, spelled like the other ones."""

    num_envs = FLOCK.num_agents

    def __init__(self, mode: str) -> None:
        self.inner = parallel_env(FLOCK, action_mode=mode)
        self.step, self.reset = self.inner.step_array, self.inner.reset_array


def start(environment: Any) -> None:
    if isinstance(environment, VecEnv):
        environment.seed(0)
        environment.reset()
    else:
        environment.reset(seed=0)


@contextmanager
def refused(field: str, label: str) -> Iterator[None]:
    """Check that an action is refused by the name of its field."""
    found = "no error"
    try:
        yield
    except ActionError as error:
        found = error.field
    assert (label, found) == (label, field)


# Actions that every space rejects, with any bounds.
BAD_BOX = {
    "nan": np.array([np.nan], np.float32),
    "inf": np.array([np.inf], np.float32),
    "minus inf": np.array([-np.inf]),
    "above": np.array([1e9]),
    "below": np.array([-1.001]),
    "two numbers": np.zeros(2, np.float32),
    "no number": np.zeros(0, np.float32),
    "a scalar": np.float32(0.5),
    "too many axes": np.zeros((1, 1), np.float32),
    "bool": np.array([True]),
    "text": np.array(["0.5"]),
    "object": np.array([0.5], object),
    "complex": np.array([0.5 + 0j]),
    "none": None,
    "dict": {"action": 0.5},
}
BAD_INDEX = {
    "negative": np.int64(-1),
    "too large": np.int64(21),
    "a float": np.float64(3.0),
    "nan": np.float64(np.nan),
    "bool": np.bool(True),
    "text": np.str_("3"),
    "a row": np.array([3]),
    "complex": np.complex128(3),
    "none": None,
    "dict": {"action": 3},
}
BAD = {mode: BAD_INDEX if mode == "discrete" else BAD_BOX for mode in GOOD}
RAGGED = [[0.5], [0.5, 0.5]]


@pytest.mark.parametrize("interface", SINGLE)
@pytest.mark.parametrize("mode", GOOD)
def test_one_action(interface: str, mode: str) -> None:
    environment, twin = SINGLE[interface](mode), SINGLE[interface](mode)
    for each in (environment, twin):
        each.reset(seed=0)
        each.step(GOOD[mode])
    for label, action in BAD[mode].items():
        with refused("action", label):
            environment.step(action)
    np.testing.assert_equal(environment.step(GOOD[mode]), twin.step(GOOD[mode]))


@pytest.mark.parametrize("interface", SINGLE)
@pytest.mark.parametrize("mode", GOOD)
def test_ragged_action(interface: str, mode: str) -> None:
    environment = SINGLE[interface](mode)
    environment.reset(seed=0)
    with pytest.raises(ActionError):
        environment.step(RAGGED)


@pytest.mark.parametrize("mode", GOOD)
def test_action_of_one_agent(mode: str) -> None:
    """The other agents' good actions do not make the bad one pass, and the error says whose it was."""
    environment, twin = parallel_env(FLOCK, action_mode=mode), parallel_env(FLOCK, action_mode=mode)
    for each in (environment, twin):
        each.reset(seed=0)
    actions = dict.fromkeys(environment.agents, GOOD[mode])
    for label, action in BAD[mode].items():
        with refused("action of 'agent_3'", label):
            environment.step({**actions, "agent_3": action})
    np.testing.assert_equal(environment.step(actions), twin.step(actions))


@pytest.mark.parametrize("mode", GOOD)
def test_who_acts(mode: str) -> None:
    environment, twin = parallel_env(FLOCK, action_mode=mode), parallel_env(FLOCK, action_mode=mode)
    for each in (environment, twin):
        each.reset(seed=0)
    actions = dict.fromkeys(environment.agents, GOOD[mode])
    missing = {agent: action for agent, action in actions.items() if agent != "agent_2"}
    for bad, name in (({**actions, "agent_9": GOOD[mode]}, "agent_9"), (missing, "agent_2"), ({}, "agent_0")):
        with pytest.raises(ActionError) as caught:
            environment.step(bad)
        assert caught.value.field == f"action of {name!r}"
    np.testing.assert_equal(environment.step(actions), twin.step(actions))


BAD_ENTRIES = {
    "normalized": [np.nan, np.inf, -np.inf, 1.001, -1.001],
    "range": [np.nan, np.inf, -np.inf, 100.1, -0.1],
    "discrete": [-1, 21, 10**9],
}


BAD_STACKS: dict[str, Callable[[np.ndarray], Any]] = {
    "one less": lambda good: good[:-1],
    "twice": lambda good: np.concatenate([good, good]),
    "no row": lambda good: good[:0],
    "axes": lambda good: good[..., np.newaxis],
    "bool": lambda good: good.astype(bool),
    "object": lambda good: good.astype(object),
    "text": lambda good: good.astype(str),
    "complex": lambda good: good.astype(complex),
    "none": lambda good: None,
    "ragged": lambda good: RAGGED,
}


@pytest.mark.parametrize("interface", STACKED)
@pytest.mark.parametrize("mode", GOOD)
def test_a_stack_of_actions(interface: str, mode: str) -> None:
    """All slots stay where they are, not only the one whose action is bad."""
    environment, twin = STACKED[interface](mode), STACKED[interface](mode)
    for each in (environment, twin):
        start(each)
    good = np.stack([GOOD[mode]] * environment.num_envs)
    for entry in BAD_ENTRIES[mode]:
        bad = good.copy()
        bad[2] = entry
        with refused("action[2]", str(entry)):
            environment.step(bad)
    for label, spoil in BAD_STACKS.items():
        with refused("action", label):
            environment.step(spoil(good))
    np.testing.assert_equal(environment.step(good), twin.step(good))


@pytest.mark.parametrize("mode", ["normalized", "range"])
def test_bounds_themselves_are_actions(mode: str) -> None:
    """Also where a bound has no exact float32 form, and the space's own samples lie beyond it."""
    options = {"min_range": 0.1, "max_range": 0.7, "action_mode": mode}
    environment = FlockEscapeEnv(FLOCK, **options)
    environment.reset(seed=0)
    for bound, expected in ((environment.action_space.low, 0.1), (environment.action_space.high, 0.7)):
        for action in (bound, bound.astype(np.float64), bound.tolist()):
            rho = environment.step(action)[-1]["interaction_range"]
            assert 0.1 <= rho <= 0.7
            assert rho == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("interface", [*SINGLE, *STACKED, "parallel"])
def test_step_before_reset(interface: str) -> None:
    if interface in STACKED:
        environment = STACKED[interface]("normalized")
        action: Any = np.stack([GOOD["normalized"]] * environment.num_envs)
    elif interface in SINGLE:
        environment, action = SINGLE[interface]("normalized"), GOOD["normalized"]
    else:
        environment = parallel_env(FLOCK)
        action = dict.fromkeys(environment.possible_agents, GOOD["normalized"])
    with pytest.raises(ResetNeeded, match=r"reset\(\)"):
        environment.step(action)
    environment.reset()
    environment.step(action)


@pytest.mark.parametrize("interface", [*SINGLE, "parallel"])
def test_step_after_the_end(interface: str) -> None:
    environment = parallel_env(FLOCK) if interface == "parallel" else SINGLE[interface]("normalized")
    environment.reset(seed=0)
    good = GOOD["normalized"]
    action = dict.fromkeys(environment.agents, good) if interface == "parallel" else good
    has_ended = False
    while not has_ended:
        _, _, terminated, truncated, _ = environment.step(action)
        if interface == "parallel":
            terminated, truncated = any(terminated.values()), any(truncated.values())
        has_ended = terminated or truncated
    for _ in range(2):
        with pytest.raises(EpisodeError, match=r"step\(\) called .*after the end"):
            environment.step(action)
    environment.reset()
    environment.step(action)


def test_aec_names_the_agent() -> None:
    environment = env(FLOCK)
    environment.reset(seed=0)
    good, bad = np.zeros(1, np.float32), np.full(1, np.nan, np.float32)
    for action in (good, good, bad, good):
        environment.step(action)
    with pytest.raises(ActionError) as caught:
        environment.step(good)  # the last agent's action moves the flock
    assert caught.value.field == "action of 'agent_2'"


@pytest.mark.parametrize("interface", REMEMBERING)
def test_a_refused_step_leaves_the_memory_of_policies(interface: str) -> None:
    """A policy with a memory is asked after the checks of the action and of the episode."""
    weave = Weave()
    environment, twin = (REMEMBERING[interface](policy) for policy in (weave, Weave()))
    for each in (environment, twin):
        start_any(each, 3)
        play(each, np.random.default_rng(0), 3)
    calls = weave.calls
    bad = draw(environment, np.random.default_rng(1))
    if isinstance(bad, dict):
        bad["agent_4"] = np.full(1, np.nan)
    else:
        bad[-1] = np.nan
    with pytest.raises(ActionError):
        environment.step(bad)
    assert weave.calls == calls
    np.testing.assert_equal(*(play(each, np.random.default_rng(2), 12) for each in (environment, twin)))
    if interface in {"gymnasium", "pursuit", "parallel"}:
        while not has_ended(environment, environment.step(draw(environment, np.random.default_rng(3)))):
            pass
        calls = weave.calls
        with pytest.raises(ResetNeeded):
            environment.step(np.zeros(2 if interface == "pursuit" else 1, np.float32))
        assert weave.calls == calls
