"""Laws of motion: exact results, limits, and the distributions of noise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from option_table import DIMENSIONS, UNLIKE, small_flock
from scipy import stats

from flockesc_env import FlockEscapeEnv, FlockScenario, Reynolds, Trajectory, Vicsek, parallel_env, simulate

EVERYWHERE = 1e9  # m; every agent hears every other one
dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)
ALONE: dict[str, Any] = {"num_agents": 4000, "num_steps": 1, "predators": ()}


def assert_same_run(first: Trajectory, second: Trajectory) -> None:
    for name in ("positions", "velocities", "mean_distance", "min_distance", "num_components"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name), err_msg=name)


def headings(velocities: np.ndarray) -> np.ndarray:
    return velocities / np.linalg.norm(velocities, axis=-1, keepdims=True)


def angles(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the angle between headings; in the plane it is signed, positive counterclockwise."""
    cosine = (first * second).sum(axis=-1)
    if first.shape[-1] == 2:
        return np.arctan2(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0], cosine)
    return np.arctan2(np.linalg.norm(np.cross(first, second), axis=-1), cosine)


def assert_distributed(sample: np.ndarray, low: float, high: float) -> None:
    assert low - 1e-6 <= sample.min()
    assert sample.max() <= high + 1e-6
    assert stats.kstest(sample, stats.uniform(low, high - low).cdf).pvalue > 0.01


@dimensions
@pytest.mark.parametrize("motion", [{}, {"motion": Vicsek()}])
def test_equal_agents_are_the_shared_numbers(dimension: int, motion: dict[str, Any]) -> None:
    shared = small_flock(dimension, num_agents=100, **motion)
    names = ("mass", "speed", "repulsion_strength", "alignment_strength")
    each = shared.replace(**{name: np.full(100, getattr(shared, name)) for name in names})
    assert_same_run(simulate(each, 8.0, seed=1), simulate(shared, 8.0, seed=1))


@dimensions
def test_agents_start_with_their_own_speed(dimension: int) -> None:
    scenario = small_flock(dimension, speed=UNLIKE["speed"])
    run, same = (simulate(each, 5.0, seed=1) for each in (scenario, small_flock(dimension)))
    np.testing.assert_allclose(np.linalg.norm(run.velocities[0], axis=1), scenario.speed, rtol=1e-15)
    np.testing.assert_allclose(headings(run.velocities[0]), headings(same.velocities[0]), rtol=1e-14)


@dimensions
def test_stubborn_leaders_fly_straight(dimension: int) -> None:
    """Agents without alignment and repulsion move uniformly; the others follow them."""
    strengths = np.arange(40) % 2.0
    scenario = small_flock(
        dimension, num_agents=40, alignment_strength=strengths, repulsion_strength=10 * strengths
    )
    run = simulate(scenario, 15.0, seed=3)
    leaders = strengths == 0
    times = scenario.time_step * np.arange(scenario.num_steps + 1)
    straight = run.positions[0] + times[:, None, None] * run.velocities[0]
    np.testing.assert_allclose(run.positions[:, leaders], straight[:, leaders], atol=1e-12)
    assert (np.abs(run.positions[-1] - straight[-1]).max(axis=1)[~leaders] > 0.1).all()


@dimensions
def test_without_repulsion_the_predator_has_no_effect(dimension: int) -> None:
    scenario = small_flock(dimension, num_agents=70, repulsion_strength=0.0)
    run, free = (simulate(each, 8.0, seed=1) for each in (scenario, scenario.replace(predators=())))
    np.testing.assert_array_equal(run.positions, free.positions)
    np.testing.assert_array_equal(run.velocities, free.velocities)
    assert np.isfinite(run.mean_distance).all()


@dimensions
def test_vicseks_agents_have_no_mass(dimension: int) -> None:
    light = small_flock(dimension, num_agents=70, mass=1e-12, alignment_strength=0.7)
    run, limit = (simulate(each, 8.0, seed=1) for each in (light, light.replace(motion=Vicsek(), mass=5.0)))
    np.testing.assert_allclose(limit.velocities, run.velocities, atol=1e-6)
    np.testing.assert_allclose(limit.positions, run.positions, atol=1e-6)


@dimensions
@pytest.mark.parametrize("eta", [0.0, 0.5, 2.0, 5.0, 2 * np.pi])
def test_polarization_of_vicseks_agents_in_range_of_all(dimension: int, eta: float) -> None:
    """One step leaves headings independent around a common one: <phi^2> = 1/n + (1 - 1/n) sinc^2(eta / 2)."""
    n, flocks = 20, 400
    scenario = FlockScenario(
        num_agents=n, dimension=dimension, num_steps=2, predators=(), motion=Vicsek(), angular_noise=eta
    )
    squares = [simulate(scenario, EVERYWHERE, seed=seed).polarization[1:] ** 2 for seed in range(flocks)]
    mean_cosine = np.sinc(eta / 2 / np.pi)
    expected = 1 / n + (1 - 1 / n) * mean_cosine**2
    error = np.std(squares, axis=0) / np.sqrt(flocks)
    assert (np.abs(np.mean(squares, axis=0) - expected) <= 3 * error + 1e-12).all()


@pytest.mark.parametrize("eta", [1e-3, 1.0, 4.0, 2 * np.pi])
@pytest.mark.parametrize("motion", [{}, {"motion": Vicsek()}, {"constant_speed": False}])
def test_angular_noise_in_the_plane(eta: float, motion: dict[str, Any]) -> None:
    """An agent without neighbors is turned by noise only."""
    run = simulate(FlockScenario(angular_noise=eta, **ALONE, **motion), 0.0, seed=5)
    before, after = run.velocities
    assert_distributed(angles(headings(before), headings(after)), -eta / 2, eta / 2)
    silent = simulate(FlockScenario(**ALONE, **motion), 0.0, seed=5).velocities[1]
    np.testing.assert_allclose(np.linalg.norm(after, axis=1), np.linalg.norm(silent, axis=1), rtol=1e-12)


@pytest.mark.parametrize("eta", [1e-3, 1.0, 4.0, 2 * np.pi])
@pytest.mark.parametrize("motion", [{}, {"motion": Vicsek()}])
def test_angular_noise_in_space(eta: float, motion: dict[str, Any]) -> None:
    scenario = FlockScenario(dimension=3, angular_noise=eta, **ALONE, **motion)
    start = np.tile([0.0, 0.0, 10.0], (4000, 1))
    run = simulate(scenario, 0.0, seed=5, initial_velocities=start)
    turned = headings(run.velocities[1])
    assert_distributed(angles(headings(start), turned), 0.0, eta / 2)
    assert_distributed(np.arctan2(turned[:, 1], turned[:, 0]), -np.pi, np.pi)


@dimensions
def test_sensing_noise_as_large_as_the_heard_velocity(dimension: int) -> None:
    """The sum of two unit vectors halves the angle between them, which is uniform over all directions."""
    scenario = FlockScenario(dimension=dimension, sensing_noise=1.0, motion=Vicsek(), **ALONE)
    run = simulate(scenario, 0.0, seed=5)
    turned = angles(*headings(run.velocities))
    if dimension == 2:
        assert_distributed(turned, -np.pi / 2, np.pi / 2)
    else:
        assert_distributed(np.cos(2 * turned), -1.0, 1.0)


@dimensions
def test_sensing_noise_on_the_speed_of_each(dimension: int) -> None:
    """The error scales with v0_i, so an agent's turn does not depend on its speed."""
    speeds = np.linspace(1.0, 20.0, 4000)
    scenario = FlockScenario(dimension=dimension, sensing_noise=0.3, motion=Vicsek(), **ALONE)
    own, shared = (simulate(each, 0.0, seed=5) for each in (scenario.replace(speed=speeds), scenario))
    np.testing.assert_allclose(headings(own.velocities[1]), headings(shared.velocities[1]), atol=1e-12)
    # The sine of the turn is at most the error over the heard speed.
    assert np.abs(np.sin(angles(*headings(own.velocities)))).max() == pytest.approx(0.3, rel=1e-2)


@dimensions
@pytest.mark.parametrize("noise", ["angular_noise", "sensing_noise"])
def test_noise_depends_on_the_seed_and_moves_no_other_draw(dimension: int, noise: str) -> None:
    quiet = small_flock(dimension, num_agents=100)
    noisy = quiet.replace(**{noise: 0.5})
    run, again, other = (simulate(noisy, 8.0, seed=seed) for seed in (1, 1, 2))
    assert_same_run(run, again)
    np.testing.assert_array_equal(run.positions[0], simulate(quiet, 8.0, seed=1).positions[0])
    given = {"initial_positions": run.positions[0], "initial_velocities": run.velocities[0]}
    assert_same_run(simulate(noisy, 8.0, seed=1, **given), run)
    assert (simulate(noisy, 8.0, seed=2, **given).velocities[1] != run.velocities[1]).any(axis=1).all()
    assert (other.positions[0] != run.positions[0]).all()


@dimensions
@pytest.mark.parametrize("motion", [{}, {"motion": Vicsek()}])
def test_a_delay_as_long_as_the_episode_repeats_the_first_force(
    dimension: int, motion: dict[str, Any]
) -> None:
    """Vicsek's agents keep the heading of the first step; inertial agents feel one constant force."""
    scenario = small_flock(dimension, num_agents=70, predators=(), sensing_delay=10, **motion)
    run = simulate(scenario, 8.0, seed=4)
    force = headings(simulate(scenario.replace(motion=Vicsek()), 8.0, seed=4).velocities[1])
    if motion:
        np.testing.assert_allclose(run.velocities[1:], np.tile(10.0 * force, (10, 1, 1)), atol=1e-9)
    else:
        gain = scenario.time_step / 0.1 * 10.0
        pushed = 10.0 * headings(run.velocities[:-1] + gain * force)
        np.testing.assert_allclose(run.velocities[1:], pushed, atol=1e-9)


@dimensions
def test_boids_without_weights_equal_inertial_agents(dimension: int) -> None:
    paper = small_flock(dimension, num_agents=100)
    boids = paper.replace(motion=Reynolds(0.0, 0.0, 10.0))
    assert_same_run(simulate(boids, 8.0, seed=1), simulate(paper, 8.0, seed=1))


@dimensions
def test_two_boids_keep_apart(dimension: int) -> None:
    """Cohesion and separation of two agents at rest point along the line between them."""
    law = Reynolds(separation_strength=3.0, cohesion_strength=1.0, separation_range=5.0)
    scenario = small_flock(dimension, num_agents=2, num_steps=1, predators=(), motion=law)
    for distance, expected in [(4.9, -2.0), (5.0, -2.0), (5.1, 1.0), (9.0, 0.0)]:
        positions = np.zeros((2, dimension))
        positions[1, 1] = distance
        run = simulate(
            scenario.replace(constant_speed=False),
            8.0,
            initial_positions=positions,
            initial_velocities=np.zeros((2, dimension)),
        )
        pushed = scenario.time_step / 0.1 * expected * 10.0
        np.testing.assert_allclose(run.velocities[1, :, 1], [pushed, -pushed], atol=1e-12)
        assert (np.delete(run.velocities[1], 1, axis=1) == 0).all()


def test_boids_attract_each_other_across_the_border() -> None:
    law = Reynolds(separation_strength=0.0)
    scenario = small_flock(num_agents=2, num_steps=1, predators=(), motion=law, periodic_side=20.0)
    run = simulate(
        scenario.replace(constant_speed=False),
        8.0,
        initial_positions=[[1.0, 5.0], [19.0, 5.0]],
        initial_velocities=np.zeros((2, 2)),
    )
    np.testing.assert_allclose(run.velocities[1], [[-5.0, 0.0], [5.0, 0.0]], atol=1e-12)


@dimensions
def test_cohesion_shrinks_a_flock_and_separation_expands_it(dimension: int) -> None:
    scenario = FlockScenario(num_agents=60, dimension=dimension, initial_side=30.0, predators=())

    def spread(motion: Reynolds) -> float:
        end = simulate(scenario.replace(motion=motion), 15.0, seed=2).positions[-1]
        return float(np.sqrt(((end - end.mean(axis=0)) ** 2).sum(axis=1).mean()))

    apart, plain, together = (spread(Reynolds(s, c, 15.0)) for s, c in [(1.0, 0.0), (0.0, 0.0), (0.0, 1.0)])
    assert together < plain < apart


@dimensions
def test_observations_of_agents_with_different_speeds(dimension: int) -> None:
    """The speeds of all agents are scaled by the largest v0_i."""
    scenario = small_flock(dimension, **UNLIKE)
    env = FlockEscapeEnv(scenario)
    agents = parallel_env(scenario)
    observation, _ = env.reset(seed=1)
    rows, _ = agents.reset(seed=1)
    speed = observation[env.policy_spec.layout.index("speed")]
    assert speed == pytest.approx(np.mean(scenario.speed) / (np.mean(scenario.speed) + 10.0))
    for _ in range(scenario.num_steps):
        assert env.observation_space.contains(observation)
        assert all(agents.observation_space(name).contains(row) for name, row in rows.items())
        observation, *_ = env.step(np.array([0.0], np.float32))
        rows, *_ = agents.step({name: np.array([0.0], np.float32) for name in agents.agents})
