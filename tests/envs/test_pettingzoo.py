"""The PettingZoo contract for whole episodes."""

import math
from typing import Any

import numpy as np
import pytest
from envs import draw
from option_table import (
    ACTION_MODES,
    AGENT_REWARDS,
    DIMENSIONS,
    EVERY_STEP,
    INDIVIDUAL_REWARDS,
    OBJECTIVES,
    every_pair,
    hunted,
    small_flock,
)
from pettingzoo.utils import aec_to_parallel, parallel_to_aec
from pettingzoo.utils.wrappers import ClipOutOfBoundsWrapper
from same import spoil

from flockesc_env import FlockEscapeEnv
from flockesc_env.common.errors import FlockescError
from flockesc_env.envs.pettingzoo import FlockParallelEnv
from flockesc_env.flockesc_v1 import env, parallel_env, raw_env
from flockesc_env.scenario import Learned


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


HUNTERS = (Learned((10.0, 10.0), (5.0, 0.0)), Learned((20.0, 20.0), (0.0, -5.0)))
SCENARIOS = {
    "plain": small_flock(),
    "capture": hunted(),
    "two hunters": small_flock(num_agents=12, predators=HUNTERS),
    "hunters that catch some": small_flock(3, num_agents=12, predators=HUNTERS, capture_radius=12.0),
    "hunters that catch all": small_flock(num_agents=12, predators=HUNTERS, capture_radius=500.0),
}


def as_dicts(result: Any, names: list[str], reward: str) -> list[dict[str, Any]]:
    """Return what ``step`` must return for all agents if ``step_array`` returned these arrays."""
    rows, rewards, terminations, truncations, info = result
    shared = dict(info)
    ranges, seen = shared.pop("interaction_range"), shared.pop("predator_observations", ())
    # The rewards of caught agents are 0.
    paid = math.fsum(rewards) / len(rows) if reward in INDIVIDUAL_REWARDS else max(rewards, key=abs)
    hunters = len(seen)
    columns = (
        [*rows, *seen],
        [*rewards, *[0.0 - paid] * hunters],
        [*terminations, *[terminations.all()] * hunters],
        [*truncations, *[truncations.any()] * hunters],
        [*({**shared, "interaction_range": rho} for rho in ranges), *[shared] * hunters],
    )
    return [dict(zip(names, column, strict=True)) for column in columns]


@every_pair(
    kind=SCENARIOS,
    mode=ACTION_MODES,
    reward=AGENT_REWARDS,
    objective=OBJECTIVES,
    infos=("all", "end"),
    steps_per_action=(1, 4),
)
def test_dicts_equal_the_arrays(
    kind: str, mode: str, reward: str, objective: str, infos: Any, steps_per_action: int
) -> None:
    """Stepped with dicts, with arrays, or with both in turn; then all that was returned is changed."""
    scenario, options = SCENARIOS[kind], {"action_mode": mode, "reward": reward, "objective": objective}
    options |= {"steps_per_action": steps_per_action, "count_components": True, "max_range": 100.0}
    dicts, mixed = (parallel_env(scenario, infos=infos, **options) for _ in range(2))
    arrays, names = parallel_env(scenario, **options), dicts.possible_agents
    flock, hunters = names[: scenario.num_agents], names[scenario.num_agents :]
    start = {"initial_positions": np.eye(scenario.num_agents)[:, : scenario.dimension]}
    for seed, given in ((3, None), (8, start), (None, {})):
        started = dicts.reset(seed=seed, options=given)
        np.testing.assert_equal(mixed.reset(seed=seed, options=given), started)
        rows, info = arrays.reset_array(seed=seed, options=given)
        at_rest = np.zeros(len(flock)), np.zeros(len(flock), bool), np.zeros(len(flock), bool)
        expected = as_dicts((rows, *at_rest, info), names, reward)
        np.testing.assert_equal(started, (expected[0], expected[-1]))
        spoil((started, rows, info))
        rng, is_array_turn, terminations = np.random.default_rng(1), True, at_rest[1]
        while acting := dicts.agents:
            assert arrays.agents == mixed.agents == acting
            actions, is_caught = draw(dicts, rng), terminations
            # Actions of caught agents are ignored.
            ignored = np.array(10**6) if mode == "discrete" else np.full(1, np.nan)
            in_flock = np.array([actions.get(agent, ignored) for agent in flock])
            pushes = np.array([actions[agent] for agent in hunters]) if hunters else None
            result = arrays.step_array(in_flock, pushes)
            in_turn = mixed.step_array(in_flock, pushes) if is_array_turn else mixed.step(actions)
            stepped = dicts.step(actions)
            np.testing.assert_equal(in_turn, result if is_array_turn else stepped)
            is_array_turn = not is_array_turn
            expected = as_dicts(result, names, reward)
            ended = [agent for agent in acting if expected[2][agent] or expected[3][agent]]
            if infos == "end":
                expected[-1] |= {agent: {} for agent in acting if agent not in ended}
            for part, whole in zip(stepped, expected, strict=True):
                np.testing.assert_equal(part, {agent: whole[agent] for agent in acting})
            assert dicts.agents == [agent for agent in acting if agent not in ended]
            _, rewards, terminations, truncations = result[:-1]
            assert [part.dtype for part in result[:-1]] == [np.float32, np.float64, np.bool, np.bool]
            for values, cell in zip(stepped[1:], (float, bool, bool, dict), strict=True):
                assert list(values) == acting
                assert {type(value) for value in values.values()} == {cell}
            assert not result[0][terminations].any()
            assert not rewards[is_caught].any()
            assert terminations[is_caught].all()
            assert not (terminations & truncations).any()
            terminations = terminations.copy()
            spoil((stepped, in_turn, result, actions, in_flock, pushes))
    for call in (lambda: arrays.step_array(in_flock, pushes), lambda: mixed.step({})):
        with pytest.raises(FlockescError):
            call()
