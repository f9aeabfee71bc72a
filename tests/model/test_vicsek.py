"""The Vicsek model against a NumPy model written from the paper of 1995: order parameter against noise."""

from __future__ import annotations

import numpy as np
import pytest

from flockesc_env import FlockScenario, Vicsek, simulate

N, SIDE, STEP = 40, 3.1, 0.03  # the smallest system of Fig. 2(a), with the radius as unit of length
FLOCKS, STEPS, TRANSIENT = 60, 200, 100


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
    scenario = FlockScenario(
        num_agents=N,
        num_steps=STEPS,
        time_step=1.0,
        speed=STEP,
        initial_side=SIDE,
        periodic_side=SIDE,
        predators=(),
        motion=Vicsek(),
        angular_noise=eta,
    )
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


def test_from_order_to_disorder() -> None:
    """Without noise all headings agree; under the largest noise they are independent and <v_a^2> is 1 / n."""
    curve = [mean_and_error(order_here(eta)[:, TRANSIENT:])[0] for eta in (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)]
    assert (np.diff(curve) < 0).all()
    assert curve[0] > 0.999
    squares = order_here(2 * np.pi)[:, 1:] ** 2
    mean, error = mean_and_error(squares)
    assert abs(mean - 1 / N) <= 3 * error
