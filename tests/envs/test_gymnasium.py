"""The Gymnasium contract: actions, episodes, views of the current state, and seeds in every interface."""

import pickle

import envs
import gymnasium
import numpy as np
import pytest
from envs import FLOCKS, RANDOM, info_of, same_action, start, state
from gymnasium.error import ResetNeeded
from objective_values import INFO_KEYS
from option_table import EVERY_STEP, small_flock

import flockesc_env as fe
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.spaces import RangeActions
from flockesc_env.scenario.options import EnvOptions

RHO = 25.0  # action -0.5 of [0, 100]


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
        actions = RangeActions(EnvOptions(min_range=low, max_range=high))
        ranges = rng.uniform(low, high, 100)
        error = np.abs(actions.to_ranges(actions.from_ranges(ranges), 100) - ranges)
        assert error.max() <= 2 * np.spacing(high)
        grid = rng.uniform(-1, 1, (1000, 1)).astype(np.float32)
        expected = low + (grid[:, 0].astype(np.float64) + 1) / 2 * (high - low)
        assert actions.to_ranges(grid, 1000).tolist() == expected.tolist()
        twin = pickle.loads(pickle.dumps(actions.core))  # noqa: S301, our own
        assert twin.of_array(grid.astype(float)).tolist() == expected.tolist()
        with pytest.raises(InputError, match="NaN"):
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


def test_shapes_and_read_only_arrays() -> None:
    scenario = small_flock(3, predators=RANDOM)
    for env, rows in ((fe.parallel_env(scenario), 5), (fe.PredatorEnv(small_flock(3)), 1)):
        env.reset(seed=0)
        now = state(env.flock)
        shapes = {name: value.shape for name, value in now.items() if isinstance(value, np.ndarray)}
        count = len(env.scenario.predators)
        assert shapes == {
            **dict.fromkeys(("positions", "velocities"), (5, 3)),
            **dict.fromkeys(("distances", "caught"), (5,)),
            "interaction_range": (rows,),
            **dict.fromkeys(("predator_positions", "predator_velocities"), (count, 3)),
        }
        with pytest.raises(ValueError, match="read-only"):
            env.flock.positions[:] = 0.0
        with pytest.raises(AttributeError):
            env.flock.positions = now["positions"]


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
