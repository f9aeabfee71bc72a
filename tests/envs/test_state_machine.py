"""Stateful test: after any operations an environment is in the state that its seed and actions determine.

The model is a log of resets and steps with their results. Restoring a snapshot resets the log to the point
where it was saved; rejected calls, rendering, copies and pickles do not change the log. At the end a new
environment plays the log and must return the same results, bit for bit.
"""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from envs import ADAPTERS, has_ended, same_action
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    Bundle,
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)

import flockesc_env as fe
from flockesc_env.common.errors import FlockescError, InputError

NAMES = (
    *("pictures", "different agents with noise and delay", "predator", "vector", "vector without autoreset"),
    *("a slot per agent", "parallel with capture", "line in pictures"),
)
seeds = st.integers(0, 2**64 - 4) | st.none()
parts = st.floats(-1, 1, width=32)


def action_of(env: Any, part: float) -> Any:
    """Return the action at the fraction ``part`` of the environment's action space."""
    return same_action(env, np.array([part], np.float32))


class Machine(RuleBasedStateMachine):
    """One environment and all operations on it."""

    make: Callable[[], Any]
    saves = Bundle("saves")

    def __init__(self) -> None:
        super().__init__()
        self.env = type(self).make()
        self.log: list[tuple[str, Any, Any]] = []
        self.has_ended = False

    def do(self, call: str, argument: Any) -> None:
        """Run one operation and log its result."""
        returned = play(self.env, call, argument)
        self.log.append((call, argument, copy.deepcopy(returned)))
        self.has_ended = call == "step" and has_ended(self.env, returned)

    def ignores_actions(self) -> bool:
        """Return whether the next step resets every slot of a vector environment."""
        call, _, returned = self.log[-1]
        return call == "step" and hasattr(self.env, "num_envs") and bool(np.all(returned[2] | returned[3]))

    @initialize(seed=st.integers(0, 2**64 - 4))
    def start(self, seed: int) -> None:
        self.do("reset", seed)

    @rule(seed=seeds)
    def reset(self, seed: int | None) -> None:
        self.do("reset", seed)

    @precondition(lambda self: not self.has_ended)
    @rule(part=parts)
    def step(self, part: float) -> None:
        self.do("step", action_of(self.env, part))

    @precondition(lambda self: self.has_ended)
    @rule(part=parts)
    def step_after_the_end(self, part: float) -> None:
        with pytest.raises(FlockescError):
            self.env.step(action_of(self.env, part))

    @precondition(lambda self: not self.has_ended and not self.ignores_actions())
    @rule(part=st.sampled_from([np.nan, np.inf, -1.5, 1e300]))
    def step_out_of_bounds(self, part: float) -> None:
        with pytest.raises(InputError), np.errstate(over="ignore"):
            self.env.step(action_of(self.env, part))

    @rule(seed=st.sampled_from([-1, 2**64, 1.5, "7"]))
    def reset_with_a_bad_seed(self, seed: Any) -> None:
        with pytest.raises(InputError):
            self.env.reset(seed=seed)

    @rule()
    def reset_to_a_bad_start(self) -> None:
        name = "initial_state" if isinstance(self.env, fe.LineEscapeEnv) else "initial_positions"
        with pytest.raises(InputError):
            self.env.reset(seed=1, options={name: [np.nan]})

    @rule()
    def look(self) -> None:
        if getattr(self.env, "render_mode", None) == "rgb_array":
            assert self.env.render().shape == (160, 160, 3)

    @rule()
    def close(self) -> None:
        self.env.close()

    @rule(part=parts)
    def continue_with_a_copy(self, part: float) -> None:
        original, self.env = self.env, copy.deepcopy(self.env)
        if not self.has_ended:
            original.step(action_of(original, part))
        original.reset(seed=5)

    @rule()
    def continue_with_a_pickle(self) -> None:
        original, self.env = self.env, pickle.loads(pickle.dumps(self.env))  # noqa: S301, our own
        original.reset(seed=5)

    @rule(target=saves)
    def save(self) -> tuple[bytes, list[tuple[str, Any, Any]], bool]:
        state = self.env.get_state()
        assert isinstance(state, bytes)
        assert self.env.get_state() == state
        return state, self.log.copy(), self.has_ended

    @rule(saved=saves)
    def restore(self, saved: tuple[bytes, list[tuple[str, Any, Any]], bool]) -> None:
        state, log, self.has_ended = saved
        self.env.set_state(state)
        self.log = log.copy()
        assert self.env.get_state() == state

    @rule(saved=saves)
    def restore_into_a_new_environment(self, saved: tuple[bytes, list[tuple[str, Any, Any]], bool]) -> None:
        self.env = type(self).make()
        self.restore(saved)

    def teardown(self) -> None:
        twin = type(self).make()
        for place, (call, argument, returned) in enumerate(self.log):
            np.testing.assert_equal(play(twin, call, argument), returned, err_msg=f"{place}: {call}")


def play(env: Any, call: str, argument: Any) -> Any:
    return env.reset(seed=argument) if call == "reset" else env.step(argument)


@pytest.mark.parametrize("name", NAMES)
def test_the_seed_and_the_actions_determine_the_state(name: str) -> None:
    # A new class per environment: hypothesis stores rules in classes.
    machine = type("Machine", (Machine,), {"make": staticmethod(ADAPTERS[name].make)})
    run = settings(max_examples=25, stateful_step_count=40)
    run_state_machine_as_test(machine, settings=run)
