"""Deep copies are independent of the original; tests/envs/test_states.py compares how both continue."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from envs import adapters, play, start
from option_table import small_flock

from flockesc_env import FlockEscapeEnv


@adapters()
def test_a_copy_leaves_its_original_alone(make: Callable[[], Any]) -> None:
    env, expected = make(), make()
    for each in (env, expected):
        start(each, 0)
        play(each, np.random.default_rng(0), 1)
    twin = copy.deepcopy(env)
    start(twin, 5)
    play(twin, np.random.default_rng(1), 3)
    np.testing.assert_equal(*(play(each, np.random.default_rng(2), 20) for each in (env, expected)))


@adapters()
def test_a_copy_before_the_first_reset(make: Callable[[], Any]) -> None:
    env = make()
    np.testing.assert_equal(start(copy.deepcopy(env), 1), start(env, 1))


def test_a_copy_of_an_environment_with_a_window() -> None:
    env = FlockEscapeEnv(small_flock(), render_mode="human")
    env.reset(seed=0)
    twin = copy.deepcopy(env)
    np.testing.assert_equal(*(play(each, np.random.default_rng(0), 2) for each in (twin, env)))


@pytest.mark.parametrize("mode", ["normalized", "range", "discrete"])
def test_policy_specs_are_copied_and_pickled(mode: str) -> None:
    spec = FlockEscapeEnv(small_flock(), action_mode=mode, min_range=2.0, max_range=9.0).policy_spec
    actions = spec.actions.from_ranges(np.array([2.0, 5.5, 9.0]))
    expected = spec.actions.to_ranges(actions, 3)
    for twin in (copy.deepcopy(spec), pickle.loads(pickle.dumps(spec))):  # noqa: S301, our own
        np.testing.assert_array_equal(twin.actions.to_ranges(actions, 3), expected)
