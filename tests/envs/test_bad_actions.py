"""Actions that no space contains are refused by name, and the episode goes on as if they had not come.

``test_arguments`` has more bad values, in the default action mode.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from envs import REMEMBERING, Weave, adapters, draw, has_ended, play, start, step
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from gymnasium.wrappers import RescaleAction
from option_table import ACTION_MODES, small_flock
from stable_baselines3.common.policies import BasePolicy

import flockesc_env as fe
from flockesc_env.common.errors import ActionError, EpisodeError
from flockesc_env.sb3 import AgentVecEnv, FlockVecEnv

FLOCK, LINE = small_flock(), fe.LineScenario(num_agents=5, max_steps=10)
BOX, INDEX = np.array([0.5], np.float32), np.int64(3)

SINGLE = {
    "flock": lambda mode: fe.FlockEscapeEnv(FLOCK, action_mode=mode),
    "line": lambda mode: fe.LineEscapeEnv(LINE, action_mode=mode),
    "parallel": lambda mode: fe.parallel_env(FLOCK, action_mode=mode),
}
STACKED = {
    "flock slots": lambda mode: FlockVecEnv(3, FLOCK, action_mode=mode),
    "agent slots": lambda mode: AgentVecEnv(3, FLOCK, action_mode=mode),
    "vector": lambda mode: fe.FlockVectorEnv(3, FLOCK, action_mode=mode),
    "vector with a slot per agent": lambda mode: fe.AgentVectorEnv(15, FLOCK, action_mode=mode),
}

# Actions that every space rejects, with any bounds.
BAD_BOX = [np.array([bad]) for bad in (np.nan, np.inf, 1e9, -1.001, True, "0.5", 0.5 + 0j)]
BAD_BOX += [np.zeros(2), np.zeros(0), np.float32(0.5), np.zeros((1, 1)), np.array([0.5], object), None]
BAD_ENTRIES = {
    "normalized": [np.nan, np.inf, -np.inf, 1.001, -1.001],
    "range": [np.nan, np.inf, -np.inf, 100.1, -0.1],
    "discrete": [-1, 21, 10**9],
}
modes = pytest.mark.parametrize("mode", ACTION_MODES)


def good(mode: str) -> Any:
    return INDEX if mode == "discrete" else BOX


def twins(make: Any, mode: str) -> tuple[Any, Any]:
    both = make(mode), make(mode)
    for each in both:
        start(each, 0)
    return both


def refused_field(environment: Any, actions: Any) -> str:
    with pytest.raises(ActionError) as caught:
        environment.step(actions)
    return caught.value.field


@modes
def test_who_acts(mode: str) -> None:
    environment, twin = twins(SINGLE["parallel"], mode)
    actions = dict.fromkeys(environment.agents, good(mode))
    missing = {agent: action for agent, action in actions.items() if agent != "agent_2"}
    for bad, name in (({**actions, "agent_9": good(mode)}, "agent_9"), (missing, "agent_2"), ({}, "agent_0")):
        assert refused_field(environment, bad) == f"action of {name!r}"
    np.testing.assert_equal(environment.step(actions), twin.step(actions))


@pytest.mark.parametrize("interface", STACKED)
@modes
def test_a_stack_of_actions(interface: str, mode: str) -> None:
    """All slots stay where they are, not only the one whose action is bad."""
    environment, twin = twins(STACKED[interface], mode)
    actions = np.stack([good(mode)] * environment.num_envs)
    for entry in BAD_ENTRIES[mode]:
        bad = actions.copy()
        bad[2] = entry
        assert refused_field(environment, bad) == "action[2]", entry
    for form in (actions[:-1], actions[..., np.newaxis], actions.astype(bool), actions.astype(object)):
        assert refused_field(environment, form) == "action"
    np.testing.assert_equal(environment.step(actions), twin.step(actions))


@pytest.mark.parametrize("mode", ["normalized", "range"])
def test_bounds_themselves_are_actions(mode: str) -> None:
    """Also where a bound has no exact float32 form, and the space's own samples lie beyond it."""
    environment = fe.FlockEscapeEnv(FLOCK, min_range=0.1, max_range=0.7, action_mode=mode)
    environment.reset(seed=0)
    for bound, expected in ((environment.action_space.low, 0.1), (environment.action_space.high, 0.7)):
        for action in (bound, bound.astype(np.float64), bound.tolist()):
            rho = environment.step(action)[-1]["interaction_range"]
            assert 0.1 <= rho <= 0.7
            assert rho == pytest.approx(expected, rel=1e-7)


def test_rounding_in_float32_is_clipped() -> None:
    """Where SAC, TD3 and DDPG, a scaled tanh and ``RescaleAction`` map the ends of their actions."""
    rng, ends = np.random.default_rng(0), np.array([-1, 1], np.float32)
    bounds = [(0.9, 3.7), *np.sort(10 ** rng.uniform(-2, 3, (200, 2))).tolist()]
    for low, high in bounds:
        env = fe.FlockEscapeEnv(FLOCK, min_range=low, max_range=high, action_mode="range")
        space = env.action_space
        assert isinstance(space, Box)
        rescaled = [
            BasePolicy.unscale_action(SimpleNamespace(action_space=space), ends),  # type: ignore[arg-type]
            ends * ((space.high - space.low) / 2) + (space.high + space.low) / 2,
        ]
        for least, most in ((0, 1), (-1, 1), (0.1, 0.7)):
            wrapper = RescaleAction(env, np.float32(least), np.float32(most))
            rescaled.append(np.concatenate([wrapper.action(end) for end in np.float32([[least], [most]])]))
        for actions in rescaled:
            found = env.policy_spec.actions.to_ranges(actions[:, np.newaxis], 2)
            assert ((low <= found) & (found <= high)).all()
            np.testing.assert_allclose(found, [low, high], rtol=0, atol=1e-6 * high)
        for beyond in (low - 1e-6 * high, high + 1e-6 * high):
            assert refused_field(env, np.array([beyond])) == "action"


def test_nan_is_not_told_to_clip() -> None:
    env = fe.FlockEscapeEnv(FLOCK)
    for bad, hint in ((np.nan, "a policy that returns NaN has diverged"), (np.inf, "ClipAction clips it")):
        with pytest.raises(ActionError, match=hint):
            env.step(np.array([bad]))


@adapters(lambda adapter: adapter.has_states)
def test_step_before_reset_and_after_the_end(make: Any) -> None:
    environment, ready = make(), make()
    start(ready)
    rng = np.random.default_rng(0)
    with pytest.raises(ResetNeeded, match=r"reset\(\)"):
        step(environment, draw(ready, rng))
    start(environment)
    for _ in range(10):
        actions = draw(environment, rng)
        if has_ended(environment, step(environment, actions)):
            for _ in range(2):
                with pytest.raises(EpisodeError, match=r"step\(\) called .*after the end"):
                    step(environment, actions)
            start(environment)


@pytest.mark.parametrize("interface", REMEMBERING)
def test_a_refused_step_leaves_the_memory_of_policies(interface: str) -> None:
    """A policy with a memory is asked after the checks of the action and of the episode."""
    weave = Weave()
    environment, twin = (REMEMBERING[interface](policy) for policy in (weave, Weave()))
    for each in (environment, twin):
        start(each, 3)
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
