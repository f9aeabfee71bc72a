"""The contracts of Gymnasium and PettingZoo: actions, whole episodes, views of the state, seeds."""

import math
import pickle
from typing import Any

import envs
import gymnasium
import numpy as np
import option_table as table
import pytest
from envs import FLOCKS, draw, info_of, same_action, start
from gymnasium.error import ResetNeeded
from objective_values import INFO_KEYS
from option_table import DIMENSIONS, EVERY_STEP, RANDOM, doomed, every_pair, hunted, small_flock
from pettingzoo.utils import aec_to_parallel, parallel_to_aec
from pettingzoo.utils.wrappers import ClipOutOfBoundsWrapper
from same import spoil

import flockesc_env as fe
from flockesc_env import flockesc_v1
from flockesc_env.envs.pettingzoo import FlockParallelEnv
from flockesc_env.episodes.spaces import RangeActions
from flockesc_env.scenario import Learned

RHO = 25.0  # action -0.5 of [0, 100]
HUNTERS = (Learned((10.0, 10.0), (5.0, 0.0)), Learned((20.0, 20.0), (0.0, -5.0)))
SCENARIOS = {
    "plain": small_flock(),
    "capture": hunted(),
    "two hunters": small_flock(num_agents=12, predators=HUNTERS),
    "hunters that catch some": small_flock(3, num_agents=12, predators=HUNTERS, capture_radius=12.0),
    "hunters that catch all": small_flock(num_agents=12, predators=HUNTERS, capture_radius=500.0),
}


def test_discrete_grid() -> None:
    grid = (0.0, 7.5, 30.0)
    env = fe.FlockEscapeEnv(small_flock(), action_mode="discrete", range_grid=grid)
    assert env.action_space == gymnasium.spaces.Discrete(3)
    env.reset(seed=0)
    assert [env.step(index)[-1]["interaction_range"] for index in range(3)] == list(grid)
    default = fe.FlockEscapeEnv(small_flock(), action_mode="discrete", min_range=10.0, max_range=50.0)
    assert set(default.reset(seed=0)[1]) == INFO_KEYS
    assert [default.step(index)[-1]["interaction_range"] for index in (0, 1, 20)] == [10.0, 12.0, 50.0]


def test_normalized_actions_are_a_linear_map() -> None:
    rng = np.random.default_rng(0)
    for low, high in np.sort(10 ** rng.uniform(-3, 3, (200, 2))).tolist():
        actions = RangeActions(fe.EnvOptions(min_range=low, max_range=high))
        ranges = rng.uniform(low, high, 100)
        error = np.abs(actions.to_ranges(actions.from_ranges(ranges), 100) - ranges)
        assert error.max() <= 2 * np.spacing(high)
        grid = rng.uniform(-1, 1, (1000, 1)).astype(np.float32)
        expected = low + (grid[:, 0].astype(np.float64) + 1) / 2 * (high - low)
        assert actions.to_ranges(grid, 1000).tolist() == expected.tolist()
        twin = pickle.loads(pickle.dumps(actions.core))  # noqa: S301, our own
        assert twin.of_array(grid.astype(float)).tolist() == expected.tolist()
        with pytest.raises(fe.InputError, match="NaN"):
            actions.to_range(np.array([np.nan]))


@pytest.mark.parametrize(("seed", "dimension"), [(7, 3), (2**64 - 1, 2)])
@pytest.mark.parametrize("interface", ["gymnasium", "parallel", "aec"])
def test_an_episode_equals_the_simulation(interface: str, seed: int, dimension: int) -> None:
    """The view of the flock and the infos in every step."""
    radius = 4.0 if interface == "gymnasium" else None
    scenario = small_flock(dimension, predators=RANDOM, capture_radius=radius)
    env = FLOCKS[interface](scenario, count_components=True, **EVERY_STEP)
    with pytest.raises(ResetNeeded):
        _ = env.unwrapped.flock.positions
    info = info_of(env, start(env, seed))
    run = fe.simulate(scenario, RHO, seed=seed)
    for step in range(scenario.num_steps + 1):
        flock = env.unwrapped.flock
        assert flock.step == step
        for name in ("positions", "velocities", "predator_positions"):
            np.testing.assert_array_equal(getattr(flock, name), getattr(run, name)[step])
        speeds = np.linalg.norm(flock.predator_velocities, axis=1)
        assert speeds == pytest.approx([5.0, 9.0])  # they only turn
        assert not flock.distances[flock.caught].any()
        assert not step or (flock.interaction_range == RHO).all()
        for name in ("mean_distance", "min_distance", "polarization", "fraction_surviving"):
            assert info[name] == getattr(run, name)[step]
        # Before the first action the range is 0, so every agent is alone.
        assert info["num_components"] == (run.num_components[step] if step else 5)
        if step < scenario.num_steps:
            info = info_of(env, envs.step(env, same_action(env, np.float32([-0.5]))))
    assert info["min_mean_distance"] == run.mean_distance.min()
    assert info["min_min_distance"] == run.min_distance.min()
    assert set(info) == INFO_KEYS | {"num_components"}


def test_a_line() -> None:
    env = fe.LineEscapeEnv(fe.LineScenario(num_agents=5, max_steps=10))
    with pytest.raises(ResetNeeded):
        _ = env.line
    start = [0.0, 0.25, 0.5, 0.75, 1.0]
    env.reset(options={"initial_state": start})
    assert (env.line.step, env.line.states.tolist(), env.line.interaction_range) == (0, start, 0.0)
    assert not env.line.states.flags.writeable
    env.step(np.ones(1, np.float32))
    assert (env.line.step, env.line.interaction_range) == (1, 1.0)


def test_given_positions_leave_the_drawn_headings() -> None:
    """Positions and headings come from separate streams."""
    scenario = small_flock()
    drawn = fe.simulate(scenario, RHO, seed=3)
    given = fe.simulate(scenario, RHO, seed=3, initial_positions=np.zeros((5, 2)))
    np.testing.assert_array_equal(given.velocities[0], drawn.velocities[0])
    assert (given.seed, given.is_start_given) == (3, True)
    assert not drawn.is_start_given


@pytest.mark.parametrize("interface", [*FLOCKS, "line"])
@pytest.mark.parametrize(("seed", "first"), [(0, 0), (2**64 - 1, 3)])
def test_every_episode_can_be_played_alone(interface: str, seed: int, first: int) -> None:
    """The k-th reset without a seed plays ``episode_seed(seed, k)``; a reset can start at any k."""
    scenario, line = small_flock(), fe.LineScenario(num_agents=5)
    environment = fe.LineEscapeEnv(line) if interface == "line" else FLOCKS[interface](scenario)
    for episode in range(first, first + 4):
        options = {"seed": seed, "options": {"episode": first}} if episode == first else {}
        info = info_of(environment, start(environment, **options))
        drawn = fe.episode_seed(seed, episode)
        if interface == "line":
            expected = fe.simulate_line(line, 0.1, seed=drawn).escape_distance[0]
            assert info["escape_distance"] == expected
        else:
            assert np.all(info["mean_distance"] == fe.simulate(scenario, RHO, seed=drawn).mean_distance[0])


def test_schedule_of_seeds() -> None:
    """``episode_seed`` is pure, never repeats, returns at least 2^32, and must never change."""
    assert all(fe.episode_seed(seed, 0) == seed for seed in (0, 7, 2**32, 2**63, 2**64 - 1))
    assert fe.episode_seed(np.int64(7), np.uint8(0)) == 7
    assert [fe.episode_seed(7, episode) for episode in (1, 2)] == [856522681599956647, 9029727068422764021]
    drawn = {fe.episode_seed(seed, episode) for seed in range(50) for episode in range(1, 50)}
    assert len(drawn) == 50 * 49
    assert min(drawn) >= 2**32
    assert max(drawn) < 2**63


def test_unknown_reset_options_are_ignored_with_a_warning() -> None:
    environment, twin = fe.parallel_env(small_flock()), fe.parallel_env(small_flock())
    with pytest.warns(UserWarning, match="unknown options 'nonsense'"):
        started = environment.reset(seed=4, options={"nonsense": 1})
    np.testing.assert_equal(started, twin.reset(seed=4))


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_the_flock_view_as_state_is_the_observation_of_the_flock(dimension: int) -> None:
    flock = small_flock(dimension)
    options: dict[str, Any] = {"action_mode": "range", **EVERY_STEP}
    environment = fe.parallel_env(flock, state="flock_view", profile_ranges=(0.0, 5.0), **options)
    whole = fe.FlockEscapeEnv(flock, **options)
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


@pytest.mark.parametrize("scenario", [small_flock(num_steps=40), doomed()], ids=["plain", "all caught"])
@pytest.mark.parametrize("per_agent", [True, False])
def test_conversions_play_the_same_episode(per_agent: bool, scenario: Any) -> None:
    """There and back is the same environment; agents in turn, and with clipped actions, play its episode.

    With one range it is the episode of ``FlockEscapeEnv``.
    """
    view: Any = {"per_agent": per_agent}
    environment, alone = fe.parallel_env(scenario, **view), fe.FlockEscapeEnv(scenario)
    assert aec_to_parallel(parallel_to_aec(environment)) is environment
    assert type(aec_to_parallel(flockesc_v1.env(scenario, **view))) is FlockParallelEnv
    back = aec_to_parallel(flockesc_v1.raw_env(scenario, **view))
    clipped = aec_to_parallel(ClipOutOfBoundsWrapper(flockesc_v1.env(scenario, **view)))
    assert FlockParallelEnv not in {type(back), type(clipped)}
    np.testing.assert_equal(back.reset(seed=9), started := environment.reset(seed=9))
    np.testing.assert_equal(clipped.reset(seed=9), started)
    if not per_agent:
        np.testing.assert_equal([part["flock"] for part in started], [*alone.reset(seed=9)])
    while environment.agents:
        actions = {agent: np.float32([(-1) ** i]) for i, agent in enumerate(environment.agents)}
        expected = environment.step(actions)
        np.testing.assert_equal(back.step(actions), expected)
        np.testing.assert_equal(
            clipped.step({agent: 3 * action for agent, action in actions.items()}), expected
        )
        if not per_agent:
            np.testing.assert_equal([part["flock"] for part in expected], [*alone.step(actions["flock"])])
    assert not back.agents
    assert not clipped.agents


def as_dicts(result: Any, names: list[str], reward: str) -> list[dict[str, Any]]:
    """Return what ``step`` must return for all agents if ``step_array`` returned these arrays."""
    rows, rewards, terminations, truncations, info = result
    shared = dict(info)
    ranges, seen = shared.pop("interaction_range"), shared.pop("predator_observations", ())
    # The rewards of caught agents are 0.
    paid = math.fsum(rewards) / len(rows) if reward in table.INDIVIDUAL_REWARDS else max(rewards, key=abs)
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
    mode=table.ACTION_MODES,
    reward=table.AGENT_REWARDS,
    objective=table.OBJECTIVES,
    infos=("all", "end"),
    steps_per_action=(1, 4),
)
def test_dicts_equal_the_arrays(
    kind: str, mode: str, reward: str, objective: str, infos: Any, steps_per_action: int
) -> None:
    """Stepped with dicts, with arrays, or with both in turn; then all that was returned is changed."""
    scenario, options = SCENARIOS[kind], {"action_mode": mode, "reward": reward, "objective": objective}
    options |= {"steps_per_action": steps_per_action, "count_components": True, "max_range": 100.0}
    dicts, mixed = (fe.parallel_env(scenario, infos=infos, **options) for _ in range(2))
    arrays, names = fe.parallel_env(scenario, **options), dicts.possible_agents
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
        with pytest.raises(fe.FlockescError):
            call()
