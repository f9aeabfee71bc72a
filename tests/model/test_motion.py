"""Laws of motion: the Vicsek model of 1995, limits, and the distributions of noise."""

from typing import Any

import numpy as np
import pytest
from option_table import dimensions, small_flock
from scipy import stats

from flockesc_env import FlockScenario, simulate
from flockesc_env.models import run_differences
from flockesc_env.scenario import Vicsek, preset

EVERYWHERE = 1e9  # m; every agent hears every other one
ALONE: dict[str, Any] = {"num_agents": 4000, "num_steps": 1, "predators": ()}
N, SIDE, STEP = 40, 3.1, 0.03  # the smallest system of Fig. 2(a), with the radius as unit of length
FLOCKS, STEPS, TRANSIENT = 60, 200, 100


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
@pytest.mark.parametrize("eta", [1e-3, 1.0, 4.0, 2 * np.pi])
@pytest.mark.parametrize("motion", [{}, {"motion": Vicsek()}, {"constant_speed": False}])
def test_angular_noise(dimension: int, eta: float, motion: dict[str, Any]) -> None:
    """An agent without neighbors is turned by noise only."""
    start = {"initial_velocities": np.tile([10.0, 0.0, 0.0][:dimension], (4000, 1))}
    scenario = FlockScenario(dimension=dimension, **ALONE, **motion)
    before, after = simulate(scenario.replace(angular_noise=eta), 0.0, seed=5, **start).velocities
    turned = angles(headings(before), headings(after))
    assert_distributed(turned, -eta / 2 if dimension == 2 else 0.0, eta / 2)
    if dimension == 3:
        assert_distributed(np.arctan2(after[:, 2], after[:, 1]), -np.pi, np.pi)
    silent = simulate(scenario, 0.0, seed=5, **start).velocities[1]
    np.testing.assert_allclose(np.linalg.norm(after, axis=1), np.linalg.norm(silent, axis=1), rtol=1e-12)


@dimensions
def test_sensing_noise_as_large_as_the_heard_velocity(dimension: int) -> None:
    """The sum of two unit vectors halves the angle between them, which is uniform over all directions."""
    scenario = FlockScenario(dimension=dimension, sensing_noise=1.0, motion=Vicsek(), **ALONE)
    turned = angles(*headings(simulate(scenario, 0.0, seed=5).velocities))
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
    assert run_differences(run, again) == []
    np.testing.assert_array_equal(run.positions[0], simulate(quiet, 8.0, seed=1).positions[0])
    given = {"initial_positions": run.positions[0], "initial_velocities": run.velocities[0]}
    np.testing.assert_array_equal(simulate(noisy, 8.0, seed=1, **given).velocities, run.velocities)
    assert (simulate(noisy, 8.0, seed=2, **given).velocities[1] != run.velocities[1]).any(axis=1).all()
    assert (other.positions[0] != run.positions[0]).all()


def order_of_1995(eta: float, rng: np.random.Generator) -> np.ndarray:
    """Return the order parameter v_a of many flocks, shape (FLOCKS, STEPS + 1): Eqs. (1) and (2)."""
    places = rng.uniform(0, SIDE, (2, FLOCKS, N))
    angles = rng.uniform(0, 2 * np.pi, (FLOCKS, N))
    order = [np.abs(np.exp(1j * angles).mean(axis=1))]
    for _ in range(STEPS):
        x, y = np.abs(places[..., None] - places[..., None, :])
        is_near = np.minimum(x, SIDE - x) ** 2 + np.minimum(y, SIDE - y) ** 2 <= 1
        heading = np.stack([np.cos(angles), np.sin(angles)])
        cosines, sines = (is_near.astype(float) @ heading[..., None])[..., 0]
        places = (places + STEP * heading) % SIDE
        angles = np.arctan2(sines, cosines) + rng.uniform(-eta / 2, eta / 2, (FLOCKS, N))
        order.append(np.abs(np.exp(1j * angles).mean(axis=1)))
    return np.stack(order, axis=1)


def order_here(eta: float) -> np.ndarray:
    box = {"time_step": 1.0, "speed": STEP, "initial_side": SIDE, "periodic_side": SIDE, "angular_noise": eta}
    scenario = FlockScenario(num_agents=N, num_steps=STEPS, predators=(), motion=Vicsek(), **box)
    return np.stack([simulate(scenario, 1.0, seed=seed).polarization for seed in range(FLOCKS)])


def mean_and_error(order: np.ndarray) -> tuple[float, float]:
    """Return the mean over flocks of the mean over time, and its standard error; flocks are independent."""
    each = order.mean(axis=1)
    return float(each.mean()), float(each.std(ddof=1) / np.sqrt(len(each)))


@pytest.mark.parametrize("eta", [0.5, 2.5, 4.0, 6.0])
def test_order_parameter(eta: float) -> None:
    here, there = order_here(eta), order_of_1995(eta, np.random.default_rng(1995))
    for times in (slice(1, 6), slice(TRANSIENT, None)):
        mean, error = mean_and_error(here[:, times])
        expected, its_error = mean_and_error(there[:, times])
        assert abs(mean - expected) <= 3 * np.hypot(error, its_error)


def test_mean_square_radius_of_a_ring_of_prey() -> None:
    """The virial of a steady ring around the predator: a <r^2> = b (n - 1) / (2 n) + s."""
    n = 40
    run = simulate(preset("ring").replace(num_agents=n, num_steps=4_000), EVERYWHERE, seed=3)
    squares = ((run.positions[-1] - run.predator_positions[-1, 0]) ** 2).sum(axis=1)
    assert squares.mean() == pytest.approx(900 * (n - 1) / (2 * n) + 180, rel=1e-4)
