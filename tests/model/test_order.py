"""Measures of order against exact cases, and scans against ``simulate``."""

import tracemalloc
from typing import Any

import numpy as np
import pytest
from option_table import DIMENSIONS, small_flock
from scipy.stats import ttest_1samp

import flockesc_env as fe
from flockesc_env import models
from flockesc_env.common.errors import InputError
from flockesc_env.models import order
from flockesc_env.scenario import Learned, Reynolds, preset

dimensions = pytest.mark.parametrize("dimension", DIMENSIONS)


def run_of(positions: Any, velocities: Any, **fields: Any) -> models.Trajectory:
    n, dimension = np.shape(positions)
    defaults = {"num_steps": 2, "predators": (), "initial_side": 1.0}
    scenario = fe.FlockScenario(num_agents=n, dimension=dimension, **(defaults | fields))
    return fe.simulate(scenario, 0.0, seed=1, initial_positions=positions, initial_velocities=velocities)


def circle(n: int) -> tuple[np.ndarray, np.ndarray]:
    angles = np.arange(n) * 2 * np.pi / n
    return np.stack([np.cos(angles), np.sin(angles)], axis=1), np.stack([-np.sin(angles), np.cos(angles)], 1)


def in_space(vectors: np.ndarray) -> np.ndarray:
    """Return vectors of the plane in a tilted plane."""
    return vectors @ np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0]])


def test_a_ring_rotates_and_a_parallel_flock_does_not() -> None:
    points, tangents = circle(12)
    for place in (lambda v: v, in_space):
        assert models.rotation(run_of(7 * place(points), 3 * place(tangents)))[0] == pytest.approx(1)
        assert models.rotation(run_of(7 * place(points), 3 * place(points)))[0] == pytest.approx(0)
        counter = place(tangents) * np.repeat([1, -1, 1, 1], 3)[:, None]
        assert models.rotation(run_of(place(points), counter))[0] == pytest.approx(0.5)
    with pytest.raises(InputError, match="periodic"):
        models.rotation(run_of(7 * points, tangents, periodic_side=30.0))


@dimensions
def test_distances_and_density_of_a_lattice(dimension: int) -> None:
    lattice = np.stack(np.meshgrid(*[np.arange(4.0)] * dimension), -1).reshape(-1, dimension) * 2.5
    headings = np.ones_like(lattice)
    opened, periodic = (run_of(lattice, headings, periodic_side=side) for side in (None, 10.0))
    for run in (opened, periodic):
        np.testing.assert_allclose(models.nearest_neighbor_distances(run), np.full((3, 4**dimension), 2.5))
    np.testing.assert_allclose(models.density(opened), [(4 / 7.5) ** dimension] * 3)
    np.testing.assert_allclose(models.density(periodic), [(4 / 10) ** dimension] * 3)
    ends = run_of([[0.5] * dimension, [9.5] * dimension], headings[:2], periodic_side=10.0)
    np.testing.assert_allclose(models.nearest_neighbor_distances(ends)[0], dimension**0.5)
    assert (models.density(run_of(lattice[:2], headings[:2])) == np.inf).all()


def test_correlation_length_of_a_sheared_row() -> None:
    """With u_i = i - 6, i = 1, .., 11, the sum of u_i u_(i + k) is 0 at k = 4: (11 - k)^2 - 1 = 3 k^2."""
    row = np.stack([np.arange(11.0) * 0.7, np.zeros(11)], axis=1)
    shear = np.stack([np.full(11, 20.0), np.arange(11.0)], axis=1)
    assert models.correlation_length(run_of(row, shear))[0] == pytest.approx(4 * 0.7)
    assert np.isnan(models.correlation_length(run_of(row, np.ones_like(row)))).all()


def test_correlation_length_of_a_wave_in_a_periodic_world() -> None:
    """The correlation of a sine wave is a cosine, which is zero at a quarter of the wavelength."""
    row = np.stack([np.arange(16.0), np.full(16, 8.0)], axis=1)
    wave = np.stack([np.full(16, 20.0), np.sin(np.arange(16) * np.pi / 8)], axis=1)
    assert models.correlation_length(run_of(row, wave, periodic_side=16.0))[0] == pytest.approx(4)


@pytest.mark.parametrize("scenario", ["paper-flock", "space", "vicsek"])
def test_the_correlation_length_of_blocks_has_the_digits_of_all_pairs(
    scenario: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = fe.simulate(preset(scenario).replace(num_steps=3, num_agents=1200), 10.0, seed=3)
    tracemalloc.start()
    lengths = models.correlation_length(run)
    assert tracemalloc.get_traced_memory()[1] < 5e7  # all pairs at once take more than 1e8
    tracemalloc.stop()
    monkeypatch.setattr(order, "_BLOCK", 10**9)
    assert models.correlation_length(run).tobytes() == lengths.tobytes()


@pytest.mark.parametrize(
    ("measure", "if_none_is_left"),
    [(models.rotation, 0), (models.density, np.nan), (models.correlation_length, np.nan)],
)
def test_caught_agents_do_not_count(measure: Any, if_none_is_left: float) -> None:
    scenario = preset("capture").replace(num_agents=60, capture_radius=12.0)
    run = fe.simulate(scenario, 10.0, seed=2)
    left = run.caught_at < 0
    assert 3 < left.sum() < 60
    rest = run_of(run.positions[-1, left], run.velocities[-1, left])
    assert measure(run)[-1] == pytest.approx(measure(rest)[0])
    assert np.isnan(models.nearest_neighbor_distances(run)[-1]).tolist() == (~left).tolist()
    everywhere = fe.simulate(scenario.replace(capture_radius=1e3), 10.0, seed=2)
    np.testing.assert_equal(measure(everywhere)[-1], if_none_is_left)


def test_binder_cumulants_of_known_distributions() -> None:
    assert models.binder_cumulant(np.full(9, 0.4)) == pytest.approx(2 / 3)
    gaussian = np.random.default_rng(0).normal(size=(2, 3, 400_000))
    for norms in np.linalg.norm(gaussian, axis=0):
        assert models.binder_cumulant(norms) == pytest.approx(1 / 3, abs=0.01)
    two_phases = np.zeros(100)
    two_phases[:5] = 1.0  # <v^2> = <v^4> = 0.05
    for scale in (1.0, 1e200, 1e-200):
        assert models.binder_cumulant(scale * two_phases) == pytest.approx(1 - 1 / 0.15)


SCANNED = [
    (small_flock(num_agents=30), "speed", [1.0, 12.0]),
    (small_flock(num_agents=30, motion=Reynolds()), "motion.cohesion_strength", [0.0, 3.0]),
    (small_flock(num_agents=30, predators=(), periodic_side=30.0), "angular_noise", [0.0, 4.0]),
    (small_flock(num_agents=30, predators=(Learned(),), capture_radius=15.0), "num_agents", [4.0, 30.0]),
]


@pytest.mark.parametrize(("scenario", "field", "values"), SCANNED, ids=[field for _, field, _ in SCANNED])
def test_a_scan_plays_the_flocks_of_simulate(
    scenario: fe.FlockScenario, field: str, values: list[float]
) -> None:
    seeds = [3, 2**64 - 1, 8]
    result = fe.scan(scenario, field, values, 9.0, seeds, num_threads=2)
    part, _, name = field.rpartition(".")
    for value, flocks in zip(values, result.polarization, strict=True):
        each: dict[str, Any] = (
            {part: Reynolds(cohesion_strength=value)}
            if part
            else {name: type(getattr(scenario, name))(value)}
        )
        for seed, found in zip(seeds, flocks, strict=True):
            expected = fe.simulate(scenario.replace(**each), 9.0, seed=seed).polarization
            assert found.tobytes() == expected.tobytes()


def test_means_of_a_scan_leave_out_the_first_steps() -> None:
    scenario, calls = preset("vicsek").replace(num_agents=40, num_steps=30), list[tuple[int, int]]()
    given: Any = {"skip": 10, "progress": lambda *now: calls.append(now)}
    result = fe.scan(scenario, "angular_noise", [0.5, 5.0], 20.0, range(4), **given)
    assert calls[-1] == (8, 8)
    late, order = result.polarization[..., 10:], result.order_parameter()
    np.testing.assert_array_equal(order, late.mean(axis=-1))
    np.testing.assert_array_equal(result.binder_cumulant(), [*map(models.binder_cumulant, late)])
    mean, low, high = result.mean_with_interval()
    np.testing.assert_array_equal(mean, order.mean(axis=1))
    np.testing.assert_allclose((low, high), ttest_1samp(order, 0, axis=1).confidence_interval())
    (axes,) = result.plot().axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), mean)
    assert axes.get_xlabel() == "angular_noise"
