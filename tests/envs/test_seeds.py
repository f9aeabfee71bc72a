"""A seed gives the same flock in every interface and determines all following episodes."""

import numpy as np
import pytest
from envs import FLOCKS, info_of, start
from option_table import EVERY_STEP, hunted, small_flock

import flockesc_env as fe
from flockesc_env.policies import FixedRange

RHO = 25.0
ACTION = np.array([-0.5], np.float32)  # exactly RHO of [0, 100]
SEEDS = [0, 7, 2**32, 2**63, 2**64 - 1]


@pytest.mark.parametrize(("seed", "dimension"), [(0, 2), (2**64 - 1, 3)])
def test_sweep_and_rollout_play_the_simulated_flock(seed: int, dimension: int) -> None:
    scenario = hunted(dimension)
    run = fe.simulate(scenario, RHO, seed=seed)
    survived = run.fraction_surviving[-1]
    assert survived < 1
    expected = (run.mean_distance.min(), run.min_distance.min(), run.num_components[-1], survived)
    names = ("min_mean_distance", "min_min_distance", "num_components", "fraction_surviving")
    swept = fe.sweep(scenario, [RHO], [seed])
    assert tuple(getattr(swept, name) for name in names) == expected
    for per_agent in (False, True):
        episodes = fe.rollout(scenario, FixedRange(RHO), [seed], per_agent=per_agent, **EVERY_STEP)
        assert tuple(getattr(episodes, name) for name in names) == expected
        assert episodes.seeds.tolist() == [seed]


def test_given_positions_leave_the_drawn_headings() -> None:
    """Positions and headings come from separate streams."""
    scenario = small_flock()
    drawn = fe.simulate(scenario, RHO, seed=3)
    given = fe.simulate(scenario, RHO, seed=3, initial_positions=np.zeros((5, 2)))
    np.testing.assert_array_equal(given.velocities[0], drawn.velocities[0])
    assert (given.seed, given.is_start_given) == (3, True)
    both = fe.simulate(
        scenario, RHO, initial_positions=drawn.positions[0], initial_velocities=drawn.velocities[0]
    )
    np.testing.assert_array_equal(both.positions, drawn.positions)
    assert both.is_start_given
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
    assert [fe.episode_seed(seed, 0) for seed in SEEDS] == SEEDS
    assert fe.episode_seed(np.int64(7), np.uint8(0)) == 7
    assert [fe.episode_seed(7, episode) for episode in (1, 2)] == [856522681599956647, 9029727068422764021]
    drawn = {fe.episode_seed(seed, episode) for seed in range(50) for episode in range(1, 50)}
    assert len(drawn) == 50 * 49
    assert min(drawn) >= 2**32
    assert max(drawn) < 2**63
