"""Measures of order against exact cases, and scans against ``simulate``."""

import tracemalloc
from typing import Any

import numpy as np
import pytest
from option_table import dimensions, small_flock
from scipy.signal import lfilter
from scipy.stats import ttest_1samp

import flockesc_env as fe
from flockesc_env import models
from flockesc_env.models import order
from flockesc_env.scenario import Learned, Reynolds, preset


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
    with pytest.raises(fe.InputError, match="periodic"):
        models.rotation(run_of(7 * points, tangents, periodic_side=30.0))
    assert models.rotation(points, tangents) == pytest.approx(1)
    assert models.polarization(points, np.ones_like(points)) == pytest.approx(1)


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


@pytest.mark.parametrize("scenario", ["paper-flock", "space", "order"])
def test_a_correlation_length_has_the_digits_of_all_pairs_in_little_memory(scenario: str) -> None:
    flock = preset(scenario).replace(num_steps=1, num_agents=1200)
    run, side = fe.simulate(flock, 10.0, seed=3), flock.periodic_side
    tracemalloc.start()
    found = models.correlation_length(run)[0]
    assert tracemalloc.get_traced_memory()[1] < 600 * 1200  # bytes; all pairs take 1e8
    tracemalloc.stop()
    i, j = np.triu_indices(1200, 1)
    offsets, moves = run.positions[0][i] - run.positions[0][j], run.velocities[0]
    offsets -= 0 if side is None else side * np.rint(offsets / side)
    distances, u = np.sqrt((offsets**2).sum(axis=1)), moves - moves.mean(axis=0)
    bins = np.rint(distances / models.nearest_neighbor_distances(run)[0].mean()).astype(int)
    counts = np.bincount(bins)
    r, c = (np.bincount(bins, terms) / counts for terms in (distances, (u[i] * u[j]).sum(axis=1)))
    first = int(np.argmax(c <= 0))
    r0, c0 = (r[first - 1], c[first - 1]) if first else (0.0, (u**2).sum() / 1200)
    assert found == pytest.approx(r0 + (r[first] - r0) * c0 / (c0 - c[first]), rel=1e-9)


@pytest.mark.parametrize(("name", "measure"), order.MEASURES.items())
def test_tracks_are_measured_as_runs_are(name: str, measure: Any) -> None:
    """Gaps stand for caught agents, and a periodic domain may be unwrapped."""
    caught = fe.simulate(preset("capture").replace(num_agents=60, capture_radius=12.0), 10.0, seed=2)
    gaps = np.arange(len(caught.times))[:, None] < caught.caught_at
    positions = np.where(((caught.caught_at < 0) | gaps)[..., None], caught.positions, np.nan)
    np.testing.assert_array_equal(measure(positions, caught.velocities), measure(caught))
    periodic = fe.simulate(preset("order").replace(num_agents=40, num_steps=200), 10.0, seed=2)
    unwrapped = periodic.unwrapped_positions()
    assert np.ptp(unwrapped) > 120 > periodic.positions.max()
    np.testing.assert_allclose(np.diff(unwrapped, axis=0), 0.05 * periodic.velocities[:-1], atol=1e-9)
    if name != "rotation":
        found = measure(unwrapped, periodic.velocities, side=100.0)
        np.testing.assert_allclose(found, measure(periodic), rtol=1e-9)
        np.testing.assert_array_equal(found[7], measure(unwrapped[7], periodic.velocities[7], side=100.0))


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


def test_autocorrelation_times_of_known_processes() -> None:
    """A first-order autoregression with coefficient a has the time (1 + a) / (1 - a)."""
    noise = np.random.default_rng(0).normal(size=(8, 50_000))
    for a in (0.0, 0.5, 0.9):
        series = lfilter([1.0], [1.0, -a], noise)
        assert models.autocorrelation_time(series + 7) == pytest.approx((1 + a) / (1 - a), rel=0.06)
    assert models.autocorrelation_time([0.0] * 50 + [1.0] * 50) > 10
    assert np.isnan(models.autocorrelation_time(np.full(9, 0.1)))


def mean_speed(_: np.ndarray, velocities: np.ndarray) -> float:
    return float(np.linalg.norm(velocities, axis=1).mean())


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
    result = fe.scan(scenario, {field: values}, 9.0, seeds, num_threads=2)
    measures: Any = ("polarization", "num_components", "nearest_neighbor_distance", mean_speed)
    given: Any = {"measures": measures, "skip": 3, "every": 2}
    ranges = fe.scan(scenario, {field: values}, [9.0, 4.0], seeds, **given)
    assert ranges.steps.tolist() == [*range(4, scenario.num_steps + 1, 2)]
    part, _, name = field.rpartition(".")
    for index, value in enumerate(values):
        each: dict[str, Any] = (
            {part: Reynolds(cohesion_strength=value)}
            if part
            else {name: type(getattr(scenario, name))(value)}
        )
        for row, seed in enumerate(seeds):
            run = fe.simulate(scenario.replace(**each), 9.0, seed=seed)
            assert result.series["polarization"][index, row].tobytes() == run.polarization.tobytes()
            run = fe.simulate(scenario.replace(**each), [9.0, 4.0][index], seed=seed)
            nearest = np.nanmean(models.nearest_neighbor_distances(run), axis=1)
            speed = np.full(len(nearest), run.scenario.speed)
            expected = np.transpose([run.polarization, run.num_components, nearest, speed])[4::2]
            found = np.transpose([series[index, row] for series in ranges.series.values()])
            np.testing.assert_allclose(found, expected, rtol=1e-15)


def test_statistics_of_a_scan() -> None:
    scenario, calls = preset("vicsek").replace(num_agents=40, num_steps=30), list[tuple[int, int]]()
    given: Any = {"skip": 10, "progress": lambda *now: calls.append(now)}
    fields = {"angular_noise": [0.5, 5.0, 0.5, 5.0], "num_agents": [20, 20, 40, 40]}
    for options in ({}, {"measures": ("polarization", mean_speed, "num_components")}):
        result = fe.scan(scenario, fields, 20.0, range(4), **given, **options)
        assert calls.pop() == (16, 16)
    late, means = result.series["polarization"], result.means()
    np.testing.assert_array_equal(means, late.mean(axis=-1))
    found = result.summary()
    np.testing.assert_array_equal(found["binder_cumulant"], [*map(models.binder_cumulant, late)])
    variance = (late**2).mean(axis=(1, 2)) - late.mean(axis=(1, 2)) ** 2
    np.testing.assert_allclose(found["susceptibility"], [20, 20, 40, 40] * variance)
    np.testing.assert_array_equal(found["mean"], means.mean(axis=1))
    interval = ttest_1samp(means, 0, axis=1).confidence_interval()
    np.testing.assert_allclose((found["low"], found["high"]), interval)
    assert np.isnan(result.summary("num_components")["susceptibility"]).all()
    assert found["autocorrelation_time"][0] == models.autocorrelation_time(late[0])
    assert len(result.notes()) == (10 * found["autocorrelation_time"] > 21).sum() > 0
    (axes,) = result.plot(by="num_agents").axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), found["mean"][:2])
    assert axes.get_xlabel() == "angular_noise"
    table = result.table()
    assert table["mean_speed"].to_list() == result.means("mean_speed").ravel().tolist()
    assert table.columns == [*fields, "interaction_range", "seed", *result.series]
