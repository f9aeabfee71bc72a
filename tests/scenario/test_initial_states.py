"""Initial states: the distributions of docs/model.md, and the fixed draws of a seed."""

import hashlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from option_table import dimensions
from scipy.stats import kstest, norm

import flockesc_env as fe
from flockesc_env import scenario as sc

Floats = NDArray[np.float64]

NUM_AGENTS = 2000
SIDE = 80.0
SPEED = 10.0
GOLDEN: list[tuple[Any, tuple[str, str, str]]] = [
    (sc.Square(), ("fb73eddce96cd7ae", "051318770fbe1930", "db1623dd5719e8ae")),
    (sc.Disc(30.0), ("ffb303a410e8735e", "72798d1fba350b49", "79a90a692e67f940")),
    (sc.Ring(30.0), ("92141dfc918ae1d1", "38a9d962b832fcdc", "b0a313d4e2481896")),
    (sc.Ring(30.0, 20.0), ("be2c08a3136520ed", "1acca9db3c74fca2", "7bd364aaf7c3e8da")),
    (sc.Segment((-10.0, 5.0), (50.0, 60.0)), ("efb2fb255e5c4cc8", "8b55d45be93752df", "ef7fa40e1e6ce310")),
    (sc.Gaussian(7.0), ("bef692d6ede7d980", "effaf75b82b90c88", "c6de1c4df485d282")),
    (sc.Clusters(8, 2.0), ("c791f670de64f5e5", "6d3306782c9f8cbe", "18267d16870d5939")),
    (sc.AlignedHeadings((3.0, -4.0)), ("3594d5c0ac4a1bf3", "35f52c3416dd16b8", "5313e7129b5c56df")),
    (sc.AlignedHeadings((3.0, -4.0), 0.5), ("5e1d04dbe2416429", "b9e5e96550042c9c", "45337127150232a0")),
    (sc.AlignedHeadings((0.0, 2.0), math.pi), ("5ee3726525f10b27", "70b02691b25db44f", "374330f1bdc73ff3")),
]
"""Initial positions or headings, and hashes of their draws in the plane, in space and in a plane of space."""


def start(dimension: int, **parts: Any) -> tuple[Floats, Floats]:
    """Return positions relative to the center and unit headings."""
    fields = {"num_agents": NUM_AGENTS, "num_steps": 1, "initial_side": SIDE, "speed": SPEED, **parts}
    run = fe.simulate(fe.FlockScenario(dimension=dimension, **fields), 0.0, seed=3)
    return run.positions[0] - SIDE / 2, run.velocities[0] / SPEED


def assert_uniform(samples: Floats, low: float = 0.0, high: float = 1.0) -> None:
    assert low - 1e-12 <= samples.min()
    assert samples.max() <= high + 1e-12
    assert kstest(samples, "uniform", (low, high - low)).pvalue > 0.01


def assert_all_directions(vectors: Floats) -> None:
    assert_uniform(np.arctan2(vectors[:, 1], vectors[:, 0]), -math.pi, math.pi)
    for heights in vectors.T[2:]:  # Archimedes: heights on a sphere are uniform
        assert_uniform(heights / np.linalg.norm(vectors, axis=1), -1.0, 1.0)


@dimensions
@pytest.mark.parametrize(
    ("shape", "share"),
    [
        (sc.Square(), lambda x: x / SIDE + 0.5),
        (sc.Gaussian(7.0), lambda x: norm.cdf(x / 7.0)),
        (sc.Clusters(NUM_AGENTS, 0.0), lambda x: x / SIDE + 0.5),
    ],
)
def test_coordinates_are_independent(dimension: int, shape: Any, share: Callable[[Floats], Floats]) -> None:
    """``share`` maps a coordinate to its quantile."""
    offsets, headings = start(dimension, initial_positions=shape)
    for coordinates in offsets.T:
        assert_uniform(share(coordinates))
    assert np.abs(np.corrcoef(offsets.T) - np.eye(dimension)).max() < 3 / math.sqrt(NUM_AGENTS)
    assert_all_directions(headings)


@dimensions
@pytest.mark.parametrize(
    ("shape", "inner", "outer"),
    [(sc.Disc(30.0), 0, 30), (sc.Ring(30.0, 20.0), 20, 40), (sc.Ring(30.0, 60.0), 0, 60)],
)
def test_disc_and_ring(dimension: int, shape: Any, inner: float, outer: float) -> None:
    offsets, _ = start(dimension, initial_positions=shape)
    radii = np.linalg.norm(offsets, axis=1)
    assert_uniform((radii**dimension - inner**dimension) / (outer**dimension - inner**dimension))
    assert_all_directions(offsets)


def test_segment() -> None:
    begin, end = np.array([1.0, 2.0, 3.0]), np.array([9.0, 8.0, -7.0])
    offsets, _ = start(3, initial_positions=sc.Segment(tuple(begin), tuple(end)))
    along, whole = offsets + SIDE / 2 - begin, end - begin
    part = along @ whole / (whole @ whole)
    np.testing.assert_allclose(along, part[:, None] * whole, rtol=0, atol=1e-12)
    assert_uniform(part)


@dimensions
def test_clusters(dimension: int) -> None:
    count = NUM_AGENTS // 8
    offsets, _ = start(dimension, initial_positions=sc.Clusters(8, 2.0))
    groups = offsets.reshape(count, 8, -1)  # agent i belongs to center i modulo 8
    centers = groups.mean(axis=0)
    assert np.abs(centers).max() <= SIDE / 2 + 1
    for coordinates in (groups - centers).reshape(NUM_AGENTS, -1).T:
        assert_uniform(norm.cdf(coordinates / 2.0 * math.sqrt(count / (count - 1))))
    one, _ = start(dimension, initial_positions=sc.Clusters(1, 0.0))
    assert len(np.unique(one, axis=0)) == 1


@dimensions
@pytest.mark.parametrize("max_angle", [1e-9, 0.5, 2.5, math.pi])
def test_aligned_headings(dimension: int, max_angle: float) -> None:
    direction = (3.0, -4.0, 12.0)[:dimension]
    _, headings = start(dimension, initial_headings=sc.AlignedHeadings(direction, max_angle))
    ahead = np.array(direction) / np.linalg.norm(direction)
    chord = np.linalg.norm(headings - ahead, axis=1)  # accurate for tiny angles, unlike the cosine
    if dimension == 2:
        sides = np.sign(headings @ [-ahead[1], ahead[0]])
        assert_uniform(2 * np.arcsin(chord / 2) * sides / (max_angle * (1 + 1e-6)), -1.0, 1.0)
    else:
        # A cap's area grows with the square of its chord.
        assert_uniform((chord / (2 * math.sin(max_angle / 2)) / (1 + 1e-6)) ** 2)
        left = np.cross(ahead, [0.0, 0.0, 1.0]) / np.linalg.norm(ahead[:2])
        up = np.cross(ahead, left)
        assert_uniform(np.arctan2(headings @ up, headings @ left), -math.pi, math.pi)


@pytest.mark.parametrize(("part", "hashes"), GOLDEN)
def test_the_meaning_of_a_seed(part: Any, hashes: tuple[str, str, str]) -> None:
    """The draws of a seed never change, on any machine; the paper's flock uses ``Square``.

    A plane in space has the draws of the plane.
    """
    runs, slot = [], "initial_headings" if isinstance(part, sc.AlignedHeadings) else "initial_positions"
    for expected, dimension, in_plane in zip(hashes, (2, 3, 3), (False, False, True), strict=True):
        scenario = fe.FlockScenario(num_steps=1, dimension=dimension, initial_plane=in_plane, **{slot: part})
        drawn = hashlib.sha256()
        for seed in (*range(100), 2**32, 2**64 - 1):
            run = fe.simulate(scenario, 0.0, seed=seed)
            drawn.update(run.positions[0].tobytes())
            drawn.update(run.velocities[0].tobytes())
        assert drawn.hexdigest()[:16] == expected
        runs.append(np.stack([run.positions[0], run.velocities[0]]))
    plane, _, in_space = runs
    np.testing.assert_array_equal(in_space[..., :2], plane)
    assert not in_space[..., 2].any()


@pytest.mark.parametrize(
    ("axes", "dimension", "initial_plane"), [(2, 2, False), (3, 3, False), (2, 3, False), (2, 3, True)]
)
def test_given_points_set_the_start_bit_for_bit(axes: int, dimension: int, initial_plane: bool) -> None:
    """In space, points of the plane lie at z = 0."""
    rng, lift = np.random.default_rng(0), ((0, 0), (0, dimension - axes))
    points: Any = rng.uniform(0, 100, (7, axes)), rng.normal(size=(7, axes))
    parts = {
        "initial_positions": sc.GivenPositions(points[0]),
        "initial_headings": sc.GivenHeadings(points[1]),
    }
    space = {"dimension": dimension, "initial_plane": initial_plane}
    scenario = fe.FlockScenario(num_agents=7, num_steps=5, **space, **parts)
    run = fe.simulate(scenario, 10.0, seed=1)
    positions, directions = (np.pad(each, lift) for each in points)
    np.testing.assert_array_equal(run.positions[0], positions)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    np.testing.assert_allclose(run.velocities[0], 10.0 * directions, rtol=1e-15)
    assert not run.is_start_given
    again = fe.simulate(scenario, 10.0, initial_positions=positions, initial_velocities=run.velocities[0])
    np.testing.assert_array_equal(run.positions, again.positions)
    assert fe.sweep(scenario, [10.0], [1]).min_mean_distance[0, 0] == run.mean_distance.min()
