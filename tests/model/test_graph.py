"""Perron matrix and Laplacian of the line (paper, Section II); neighbor rules against scipy and NumPy."""

from itertools import product

import numpy as np
import pytest
import reference
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay

import flockesc_env as fe
from flockesc_env.models.graph import component_labels, laplacian, neighbor_pairs, perron_matrix
from flockesc_env.scenario import Metric, NeighborRule, Topological, Voronoi, preset

lines = st.tuples(st.integers(1, 40), st.integers(0, 2**32 - 1)).map(
    lambda drawn: np.random.default_rng(drawn[1]).random(drawn[0])
)
ranges = st.sampled_from([0.0, 0.021, 0.117, 0.43, 2.0])
Floats = NDArray[np.float64]
Graph = NDArray[np.bool]


@given(lines, ranges)
def test_perron_matrix_is_row_stochastic_and_moves_the_line(states: np.ndarray, rho: float) -> None:
    matrix = perron_matrix(states, rho)
    assert matrix.shape == (len(states), len(states))
    assert (matrix >= 0).all()
    np.testing.assert_allclose(matrix.sum(axis=1), 1, atol=1e-14)
    assert (np.diag(matrix) > 0).all()
    scenario = fe.LineScenario(num_agents=len(states), predator_position=None, max_steps=1)
    moved = fe.simulate_line(scenario, rho, initial_state=states).states[1]
    np.testing.assert_allclose(matrix @ states, moved, atol=1e-14)


@given(lines, ranges)
def test_the_laplacian_makes_the_perron_matrix_and_counts_components(states: np.ndarray, rho: float) -> None:
    adjacency = np.abs(states[:, None] - states) <= rho
    degrees = adjacency.sum(axis=1)
    matrix = laplacian(states, rho)
    np.testing.assert_array_equal(matrix, np.diag(degrees) - adjacency)
    perron = np.eye(len(states)) - matrix / degrees[:, None]
    np.testing.assert_allclose(perron_matrix(states, rho), perron, atol=1e-15)
    zeros = int((np.linalg.eigvalsh(matrix) < 1e-9).sum())
    assert zeros == reference.line_components(states, rho) == reference.num_components(matrix < 0)


def matrix(pairs: NDArray[np.int64], count: int) -> Graph:
    graph = np.eye(count, dtype=bool)
    graph[tuple(pairs.T)] = True
    return graph


def offsets(scenario: fe.FlockScenario, r: Floats) -> Floats:
    """Return the offsets from agent i to agent j; on a torus the shortest ones."""
    d = r[np.newaxis] - r[:, np.newaxis]
    side = scenario.periodic_side
    return d if side is None else d - side * np.round(d / side)


def seen(scenario: fe.FlockScenario, d: Floats, v: Floats) -> Graph:
    along = np.einsum("id,ijd->ij", v, d)
    norms = np.linalg.norm(v, axis=1)[:, np.newaxis] * np.linalg.norm(d, axis=-1)
    return (along >= np.cos(np.pi - scenario.blind_angle / 2) * norms) | (scenario.blind_angle == 0)


def reference_graph(scenario: fe.FlockScenario, r: Floats, v: Floats, ranges: Floats) -> Graph:
    """Return the matrix of whether agent i hears agent j, as docs/model.md defines it."""
    d = offsets(scenario, r)
    distances = np.linalg.norm(d, axis=-1)
    graph = seen(scenario, d, v)
    if isinstance(scenario.neighbor_rule, Topological):
        others = np.where(graph & ~np.eye(len(r), dtype=bool), distances, np.inf)
        farthest = np.sort(np.hstack([np.zeros((len(r), 1)), others]), axis=1)
        k = np.minimum(np.floor(ranges + 0.5).astype(int), len(r))
        graph &= distances <= farthest[np.arange(len(r)), k, np.newaxis] * (1 + 1e-12)
    else:
        graph &= distances <= ranges[:, np.newaxis]
    if isinstance(scenario.neighbor_rule, Voronoi):
        shared = np.zeros_like(graph)
        for triangle in Delaunay(r).simplices:
            shared[np.ix_(triangle, triangle)] = True
        graph &= shared
    graph |= np.eye(len(r), dtype=bool)
    return graph & graph.T if scenario.mutual else graph


VARIANTS = [
    fe.FlockScenario(num_agents=40, dimension=dimension, initial_side=40.0, neighbor_rule=rule, **on_top)
    for dimension, rule in product((2, 3), (Metric(), Topological(), Voronoi()))
    for on_top in (
        {},
        {"blind_angle": 2.0},
        {"blind_angle": 2 * np.pi},
        {"mutual": True},
        {"blind_angle": 1.0, "mutual": True},
        {"periodic_side": 40.0, "predators": ()},
        {"periodic_side": 40.0, "predators": (), "blind_angle": 4.0, "mutual": True},
    )
    if rule != Voronoi() or (dimension == 2 and "periodic_side" not in on_top)
]


def test_the_reference_has_every_rule() -> None:
    assert {scenario.neighbor_rule.kind for scenario in VARIANTS} == set(fe._core.kinds()["neighbor_rules"])


@pytest.mark.parametrize("scenario", VARIANTS)
def test_graph_equals_the_all_pairs_reference(scenario: fe.FlockScenario) -> None:
    rng = np.random.default_rng(3)
    for count in (1, 7, 40, 150):
        if count < 4 and isinstance(scenario.neighbor_rule, Voronoi):
            continue  # too few points for scipy's triangulation
        r = rng.uniform(0, 40, (count, scenario.dimension))
        v = rng.normal(size=(count, scenario.dimension))
        for rho in (0.0, 7.0, 300.0, rng.uniform(0, 12, count)):
            graph = reference_graph(scenario, r, v, np.broadcast_to(rho, count))
            pairs = neighbor_pairs(scenario, r, rho, velocities=v)
            np.testing.assert_array_equal(matrix(pairs, count), graph)
            labels = component_labels(scenario, r, rho, velocities=v)
            expected, numbers = connected_components(graph, directed=True, connection="weak")
            lowest = np.array([np.flatnonzero(numbers == number)[0] for number in range(expected)])
            np.testing.assert_array_equal(labels, lowest[numbers])


@pytest.mark.parametrize("scenario", VARIANTS)
@pytest.mark.parametrize("is_frozen", [False, True])
def test_runs_follow_the_graph(scenario: fe.FlockScenario, is_frozen: bool) -> None:
    """The paper's law with the graph of each step, or of the first step."""
    scenario = scenario.replace(num_steps=15, frozen_graph=is_frozen)
    rng = np.random.default_rng(1)
    top = 9.0 if isinstance(scenario.neighbor_rule, Topological) else 15.0
    schedule = rng.uniform(0, top, (15, 40))
    run = fe.simulate(scenario, policy=fe.ScheduledRange(schedule), seed=5)
    state = reference.flock_start(scenario, run.positions[0], run.velocities[0])
    first = reference_graph(scenario, state.positions, state.velocities, schedule[0])
    for t in range(15):
        if not is_frozen:
            first = reference_graph(scenario, state.positions, state.velocities, schedule[t])
        assert run.num_components[t] == connected_components(first, connection="weak")[0]
        state = reference.flock_step(scenario, state, schedule[t], first)
        if scenario.periodic_side is not None:
            state.positions %= scenario.periodic_side
        np.testing.assert_allclose(run.positions[t + 1], state.positions, atol=1e-9)
        np.testing.assert_allclose(run.velocities[t + 1], state.velocities, atol=1e-9)
        state.positions, state.velocities = run.positions[t + 1], run.velocities[t + 1]


@pytest.mark.parametrize("rule", [Metric(), Topological(), Voronoi()])
@pytest.mark.parametrize("radius", [10.0, 1e3])
def test_the_graph_without_caught_agents_is_that_of_the_run(rule: NeighborRule, radius: float) -> None:
    scenario = preset("capture").replace(num_agents=60, capture_radius=radius, neighbor_rule=rule)
    run = fe.simulate(scenario, np.linspace(1.0, 9.0, 60), seed=2)
    assert (run.caught_at >= 0).sum() > 9
    for t in range(0, len(run.times), 7):
        rho, left = (
            run.interaction_ranges[min(t, len(run.times) - 2)],
            (run.caught_at < 0) | (run.caught_at > t),
        )
        if left.any():
            given = scenario, run.positions[t, left], rho[left]
            assert len(np.unique(component_labels(*given))) == run.num_components[t]
            graph = matrix(neighbor_pairs(*given), left.sum())
            assert connected_components(graph, connection="weak")[0] == run.num_components[t]
