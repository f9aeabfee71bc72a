"""Stateful test: after any operations an environment is in the state that its seed and actions determine.

The model is a log of resets and steps with their results. Restoring a snapshot resets the log to the point
where it was saved; refused calls, rendering, copies, pickles and in-place changes of arguments and results do
not change the log. At the end a new environment plays the log and must return the same results, bit for bit.
"""

import copy
import pickle
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import cloudpickle
import numpy as np
import pytest
from envs import ADAPTERS, Adapter, draw, has_ended, start
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from hypothesis import settings, stateful
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, initialize, precondition, rule
from option_table import small_flock
from same import plain, spoil
from stable_baselines3.common.vec_env import VecEnv

import flockesc_env as fe

NAMES = [name for name, adapter in ADAPTERS.items() if adapter.has_states]
PACKAGE = str(Path(fe.__file__).parent)
seeds = st.integers(0, 2**64 - 4)
draws = st.integers(0, 2**32 - 1)

Save = tuple[bytes, list[tuple[str, Any, Any]], bool, bool]


def attributes(env: Any) -> list[Any]:
    """Return the public attributes of an environment that hold arrays and dicts."""
    names = ("metadata", "action_space", "observation_space", "state_space", "action_spaces", "policy_spec")
    names += ("single_action_space", "single_observation_space", "observation_spaces", "predator_policy_spec")
    shown = [getattr(env, name, None) for name in names]
    actions = getattr(getattr(env, "policy_spec", None), "actions", None)
    shown += [env.options, env.scenario, getattr(actions, "grid", None)]
    return [attribute for attribute in shown if not callable(attribute)]


def lines_before(stop: float, call: Callable[[], Any]) -> int:
    """Call, raise KeyboardInterrupt after ``stop`` lines of the package, and return the number of lines."""
    lines = 0

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal lines
        if not frame.f_code.co_filename.startswith(PACKAGE):
            return None
        if event == "line":
            lines += 1
            if lines > stop:
                raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        call()
    finally:
        sys.settrace(before)
    return lines


class Machine(RuleBasedStateMachine):
    """One environment and all operations on it."""

    adapter: Adapter
    saves = Bundle("saves")

    def __init__(self) -> None:
        super().__init__()
        self.env = self.adapter.make()
        self.log: list[tuple[str, Any, Any]] = []
        self.has_ended = False
        self.checks_actions = False
        """Whether the next step takes an action. It takes none if it resets all slots."""

    def do(self, call: str, argument: Any) -> None:
        """Run one operation, log its result, and change in place all that was given and returned."""
        given = copy.deepcopy(argument)
        if call == "step" and isinstance(self.env, VecEnv):
            self.env.step_async(given)
            spoil(given)
            returned = self.env.step_wait()
        else:
            returned = play(self.env, call, given)
        self.log.append((call, argument, plain(returned)))
        self.has_ended = call == "step" and has_ended(self.env, returned)
        mode = getattr(self.env, "autoreset_mode", None)
        self.checks_actions = not self.has_ended
        if call == "step" and mode is AutoresetMode.NEXT_STEP:
            self.checks_actions = not np.all(returned[2] | returned[3])
        spoil((given, getattr(self.env, "reset_infos", None)))
        if not self.adapter.reuses_buffers:
            spoil(returned)

    def action(self, drawn: int) -> Any:
        return draw(self.env, np.random.default_rng(drawn))

    @initialize(seed=seeds, drawn=draws)
    def start(self, seed: int, drawn: int) -> None:
        """Before the first reset. A copy of an environment without a seed starts the same episodes."""
        with pytest.raises(fe.FlockescError, match="reset"):
            self.env.get_state()
        ready = copy.deepcopy(self.env)
        started = plain(start(ready))
        with pytest.raises(ResetNeeded, match=r"reset\(\)"):
            self.env.step(draw(ready, np.random.default_rng(drawn)))
        assert plain(start(self.env)) == started
        self.do("reset", seed)

    @rule(seed=seeds | st.none())
    def reset(self, seed: int | None) -> None:
        self.do("reset", seed)

    @precondition(lambda self: not self.has_ended)
    @rule(drawn=draws)
    def step(self, drawn: int) -> None:
        self.do("step", self.action(drawn))

    @precondition(lambda self: self.has_ended)
    @rule(drawn=draws)
    def step_after_the_end(self, drawn: int) -> None:
        with pytest.raises(fe.FlockescError, match="after the end"):
            self.env.step(self.action(drawn))

    @precondition(lambda self: self.checks_actions)
    @rule(drawn=draws, part=st.sampled_from([np.nan, np.inf, -1.5, 1e300]))
    def step_out_of_bounds(self, drawn: int, part: float) -> None:
        actions = self.action(drawn)
        if isinstance(actions, dict):
            actions[max(actions)] = np.full(np.shape(actions[max(actions)]), part)
        else:
            actions = np.full(np.shape(actions), part)
        with pytest.raises(fe.InputError):
            self.env.step(actions)

    @precondition(lambda self: self.checks_actions)
    @rule(seed=seeds, drawn=draws, part=st.floats(0, 1))
    def interrupt_a_step(self, seed: int, drawn: int, part: float) -> None:
        """After Ctrl-C at any line the state is that before or after the step, and the next step works."""
        actions, before, after = self.action(drawn), copy.deepcopy(self.env), copy.deepcopy(self.env)
        lines = lines_before(np.inf, lambda: after.step(actions))
        with pytest.raises(KeyboardInterrupt):
            lines_before(int(part * (lines - 1)), lambda: self.env.step(actions))
        mode = getattr(self.env, "autoreset_mode", None)
        if isinstance(self.env, VecEnv) or mode is AutoresetMode.SAME_STEP:
            self.env.step(self.action(drawn))  # also between the end of an episode and the reset
        else:
            twin = {env.get_state(): env for env in (before, after)}[self.env.get_state()]
            outcomes = []
            for env in (self.env, twin):
                try:
                    outcomes.append(plain(env.step(self.action(drawn))))
                except ResetNeeded as error:  # the interrupted step was the last one
                    outcomes.append(str(error))
            assert outcomes[0] == outcomes[1]
        self.log.clear()
        self.do("reset", seed)

    @rule()
    def look(self) -> None:
        if self.adapter.has_pictures:
            picture = plain(self.env.render())
            spoil(self.env.render())
            assert plain(self.env.render()) == picture

    @rule(name=st.sampled_from(["scenario", "options", "render_mode", "max_range", "reward"]))
    def assign_a_setting(self, name: str) -> None:
        env, before = self.env, getattr(self.env, name, None)
        with pytest.raises(fe.InputError, match=f"^{name}: expected no assignment after creation"):
            setattr(env, name, "another")
        assert getattr(env, name, None) is before
        spaces = {name: each for name, each in vars(env).items() if "space" in name}
        vars_of_wrappers = {**spaces, "metadata": env.metadata, "note": getattr(env, "note", 0) + 1}
        for other, value in vars_of_wrappers.items():
            setattr(env, other, copy.copy(value))

    @rule()
    def close(self) -> None:
        self.env.close()

    @rule(drawn=draws)
    def continue_with_a_copy(self, drawn: int) -> None:
        original, self.env = self.env, copy.deepcopy(self.env)
        if not self.has_ended:
            original.step(draw(original, np.random.default_rng(drawn)))
        start(original, 5)

    @rule(module=st.sampled_from([pickle, cloudpickle]))
    def continue_with_a_pickle(self, module: Any) -> None:
        original, self.env = self.env, pickle.loads(module.dumps(self.env))  # noqa: S301, our own
        start(original, 5)

    @rule(target=saves)
    def save(self) -> Save:
        state = self.env.get_state()
        assert isinstance(state, bytes)
        assert self.env.get_state() == state
        return state, self.log.copy(), self.has_ended, self.checks_actions

    @rule(saved=saves)
    def restore(self, saved: Save) -> None:
        state, log, self.has_ended, self.checks_actions = saved
        spoil(self.env.set_state(state))
        self.log = log.copy()
        assert self.env.get_state() == state

    @rule(saved=saves)
    def restore_into_a_new_environment(self, saved: Save) -> None:
        self.env = self.adapter.make()
        self.restore(saved)

    def teardown(self) -> None:
        twin, metadata = self.adapter.make(), copy.deepcopy(self.env.metadata)
        for attribute in attributes(twin):
            spoil(attribute)
        assert self.env.metadata == metadata
        for place, (call, argument, returned) in enumerate(self.log):
            assert plain(play(twin, call, argument)) == returned, f"{place}: {call}"


def play(env: Any, call: str, argument: Any) -> Any:
    return start(env, argument) if call == "reset" else env.step(argument)


@pytest.mark.parametrize("name", NAMES)
def test_the_seed_and_the_actions_determine_the_state(name: str) -> None:
    # A new class per environment: hypothesis stores rules in classes.
    machine = type("Machine", (Machine,), {"adapter": ADAPTERS[name]})
    run = settings(max_examples=10, stateful_step_count=40)
    stateful.run_state_machine_as_test(machine, settings=run)


@pytest.mark.parametrize("make", [fe.parallel_env, fe.PredatorEnv])
def test_names_and_observations_fit_the_state_after_ctrl_c_at_any_line(make: Callable[..., Any]) -> None:
    env = make(small_flock(capture_radius=60.0))
    env.reset(seed=0)
    state, actions, counts = env.get_state(), draw(env, np.random.default_rng(0)), set()
    for line in range(lines_before(np.inf, lambda: env.step(actions))):
        env.set_state(state)
        with pytest.raises(KeyboardInterrupt):
            lines_before(line, lambda: env.step(actions))
        caught = env._batch.core.caught()[0]
        counts.add(int(caught.sum()))
        if isinstance(env, fe.PredatorEnv):
            assert env._batch._has_begun.all()  # the flock is observed again before its next action
        else:
            assert env.agents == np.array(env.possible_agents)[~caught].tolist()
    assert len(counts) == 2, "the step catches agents"
