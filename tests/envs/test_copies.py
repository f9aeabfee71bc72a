"""Deep copies continue an episode identically and independently; planners rely on it."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from option_table import UNLIKE, small_flock

from flockesc_env import FlockEscapeEnv, LineEscapeEnv, LineScenario, parallel_env

ACTION = np.array([-0.8], np.float32)
OTHER_ACTION = np.array([0.9], np.float32)

MAKERS = {
    "gymnasium": lambda: FlockEscapeEnv(small_flock()),
    "different agents with noise and delay": lambda: FlockEscapeEnv(small_flock(**UNLIKE)),
    "line": lambda: LineEscapeEnv(LineScenario(num_agents=30, escape_force="linear_as_printed")),
    "parallel": lambda: parallel_env(small_flock(3), reward="individual_distance"),
    "gymnasium in a window": lambda: FlockEscapeEnv(small_flock(), render_mode="human"),
    "line in pictures": lambda: LineEscapeEnv(LineScenario(num_agents=30), render_mode="rgb_array"),
}

interfaces = pytest.mark.parametrize("interface", MAKERS)


def step(env: Any, action: np.ndarray) -> Any:
    if hasattr(env, "agents"):
        return env.step(dict.fromkeys(env.agents, action))
    return env.step(action)


@interfaces
def test_copy_continues_identically(interface: str) -> None:
    env = MAKERS[interface]()
    env.reset(seed=0)
    step(env, OTHER_ACTION)
    twin = copy.deepcopy(env)
    results = [step(env, action) for action in (ACTION, OTHER_ACTION)]
    np.testing.assert_equal([step(twin, action) for action in (ACTION, OTHER_ACTION)], results)
    # The seeds of later episodes are part of the state.
    np.testing.assert_equal(twin.reset(), env.reset())


@interfaces
def test_copy_is_independent(interface: str) -> None:
    env, expected = MAKERS[interface](), MAKERS[interface]()
    for each in (env, expected):
        each.reset(seed=0)
        step(each, OTHER_ACTION)
    twin = copy.deepcopy(env)
    step(twin, OTHER_ACTION)
    twin.reset(seed=5)
    step(twin, OTHER_ACTION)
    np.testing.assert_equal(step(env, ACTION), step(expected, ACTION))
    np.testing.assert_equal(env.reset(), expected.reset())


@interfaces
def test_copy_before_the_first_reset(interface: str) -> None:
    env = MAKERS[interface]()
    twin = copy.deepcopy(env)
    np.testing.assert_equal(twin.reset(seed=1), env.reset(seed=1))


@pytest.mark.parametrize("mode", ["normalized", "range", "discrete"])
def test_policy_specs_are_copied_and_pickled(mode: str) -> None:
    spec = FlockEscapeEnv(small_flock(), action_mode=mode, min_range=2.0, max_range=9.0).policy_spec
    actions = spec.actions.from_ranges(np.array([2.0, 5.5, 9.0]))
    expected = spec.actions.to_ranges(actions, 3)
    for twin in (copy.deepcopy(spec), pickle.loads(pickle.dumps(spec))):  # noqa: S301, our own
        np.testing.assert_array_equal(twin.actions.to_ranges(actions, 3), expected)


@interfaces
def test_copies_of_copies_branch(interface: str) -> None:
    """Tree search: branches that start from the same state and take the same actions are equal."""
    root = MAKERS[interface]()
    root.reset(seed=2)
    step(root, OTHER_ACTION)
    branches = [step(copy.deepcopy(root), ACTION) for _ in range(3)]
    branches.append(step(copy.deepcopy(copy.deepcopy(root)), ACTION))
    for branch in branches[1:]:
        np.testing.assert_equal(branch, branches[0])
