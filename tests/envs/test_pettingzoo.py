"""The PettingZoo contract for whole episodes."""

from typing import Any

import numpy as np
import pytest
from envs import draw
from objective_values import INFO_KEYS
from option_table import ACTION_MODES, AGENT_REWARDS, DIMENSIONS, EVERY_STEP, every_pair, small_flock
from pettingzoo.utils import aec_to_parallel, parallel_to_aec
from pettingzoo.utils.wrappers import ClipOutOfBoundsWrapper

from flockesc_env import FlockEscapeEnv
from flockesc_env.common.errors import FlockescError
from flockesc_env.envs.pettingzoo import FlockParallelEnv
from flockesc_env.flockesc_v1 import env, parallel_env, raw_env


def test_types_of_an_episode() -> None:
    environment = parallel_env(small_flock(), reward="individual_distance", steps_per_action=4)
    agents, rng = environment.possible_agents, np.random.default_rng(3)
    steps: list[tuple[Any, ...]] = [environment.reset(seed=3)]
    while environment.agents:
        steps.append(environment.step(draw(environment, rng)))
    assert len(steps) - 1 == 3
    assert environment.agents == []
    for number, (observations, rewards, terminations, truncations, infos) in enumerate(steps[1:], 1):
        for values in (observations, rewards, terminations, truncations, infos):
            assert list(values) == agents
        assert all(type(reward) is float for reward in rewards.values())
        assert all(terminated is False for terminated in terminations.values())
        assert all(truncated is (number == len(steps) - 1) for truncated in truncations.values())
        assert all(set(info) == INFO_KEYS for info in infos.values())
    dicts = [id(part) for step in steps for part in step]
    assert len(set(dicts)) == len(dicts)


def test_unknown_reset_options_are_ignored_with_a_warning() -> None:
    environment, twin = parallel_env(small_flock()), parallel_env(small_flock())
    with pytest.warns(UserWarning, match="unknown options 'nonsense'"):
        started = environment.reset(seed=4, options={"nonsense": 1})
    np.testing.assert_equal(started, twin.reset(seed=4))


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_the_flock_view_as_state_is_the_observation_of_the_flock(dimension: int) -> None:
    flock = small_flock(dimension)
    options: dict[str, Any] = {"action_mode": "range", **EVERY_STEP}
    environment = parallel_env(flock, state="flock_view", profile_ranges=(0.0, 5.0), **options)
    whole = FlockEscapeEnv(flock, **options)
    assert environment.state_space == whole.observation_space
    environment.reset(seed=0)
    observation, _ = whole.reset(seed=0)
    np.testing.assert_array_equal(environment.state(), observation)
    for rho in (8.0, 0.0, 64.0):
        environment.step_array(np.full((flock.num_agents, 1), rho, np.float32))
        observation, *_ = whole.step(np.array([rho], np.float32))
        np.testing.assert_array_equal(environment.state(), observation)
    ranges = np.arange(flock.num_agents, dtype=np.float32)[:, np.newaxis]
    environment.step_array(ranges)
    at = whole.policy_spec.layout.index("last_range")
    assert environment.state()[at] == pytest.approx(ranges.mean() / environment.options.max_range)


def test_conversions_play_the_same_episode() -> None:
    """There and back is the same environment; agents in turn, and with clipped actions, play its episode."""
    scenario = small_flock(num_steps=40)
    environment = parallel_env(scenario)
    assert aec_to_parallel(parallel_to_aec(environment)) is environment
    assert type(aec_to_parallel(env(scenario))) is FlockParallelEnv
    back = aec_to_parallel(raw_env(scenario))
    clipped = aec_to_parallel(ClipOutOfBoundsWrapper(env(scenario)))
    assert FlockParallelEnv not in {type(back), type(clipped)}
    np.testing.assert_equal(back.reset(seed=9), started := environment.reset(seed=9))
    np.testing.assert_equal(clipped.reset(seed=9), started)
    while environment.agents:
        actions = {agent: np.float32([(-1) ** i]) for i, agent in enumerate(environment.agents)}
        expected = environment.step(actions)
        np.testing.assert_equal(back.step(actions), expected)
        np.testing.assert_equal(
            clipped.step({agent: 3 * action for agent, action in actions.items()}), expected
        )
    assert not back.agents
    assert not clipped.agents


def as_arrays(environment: FlockParallelEnv, step: tuple[dict[str, Any], ...]) -> list[Any]:
    """Return the arrays that ``step_array`` must return if ``step`` returned these dicts."""
    agents = environment.possible_agents
    arrays = [np.array([part[agent] for agent in agents]) for part in step[:-1]]
    info = dict(step[-1][agents[0]])
    info["interaction_range"] = np.array([step[-1][agent]["interaction_range"] for agent in agents])
    return [*arrays, info]


@every_pair(mode=ACTION_MODES, reward=AGENT_REWARDS, steps_per_action=(1, 4))
def test_arrays_equal_the_dicts(mode: str, reward: str, steps_per_action: int) -> None:
    """Stepped with dicts, with arrays, or with both in turn."""
    options = {"action_mode": mode, "reward": reward, "steps_per_action": steps_per_action}
    dicts, arrays, mixed = (parallel_env(small_flock(), count_components=True, **options) for _ in range(3))
    start = {"initial_positions": np.arange(10.0).reshape(5, 2)}
    for seed, given in ((3, None), (None, None), (8, start), (None, {})):
        started = dicts.reset(seed=seed, options=given)
        np.testing.assert_equal(mixed.reset(seed=seed, options=given), started)
        np.testing.assert_equal(list(arrays.reset_array(seed=seed, options=given)), as_arrays(dicts, started))
        assert arrays.agents == dicts.agents
        rng, is_array_turn = np.random.default_rng(1), True
        while dicts.agents:
            actions = draw(dicts, rng)
            expected = as_arrays(dicts, stepped := dicts.step(actions))
            result = arrays.step_array(np.stack(list(actions.values())))
            np.testing.assert_equal(list(result), expected)
            assert [part.dtype for part in result[:-1]] == [np.float32, np.float64, np.bool, np.bool]
            assert {type(value) for value in result[-1].values()} == {float, int, np.ndarray}
            if is_array_turn:
                np.testing.assert_equal(mixed.step_array(np.stack(list(actions.values()))), result)
            else:
                np.testing.assert_equal(mixed.step(actions), stepped)
            is_array_turn = not is_array_turn
            assert arrays.agents == mixed.agents == dicts.agents
    for call in (lambda: arrays.step_array(np.stack(list(actions.values()))), lambda: mixed.step(actions)):
        with pytest.raises(FlockescError):
            call()
