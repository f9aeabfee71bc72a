"""Perron matrix and Laplacian of the line's neighbor graph (paper, Section II)."""

import numpy as np
import reference
from hypothesis import given
from hypothesis import strategies as st

from flockesc_env import LineScenario, simulate_line
from flockesc_env.models.graph import laplacian, perron_matrix

lines = st.tuples(st.integers(1, 40), st.integers(0, 2**32 - 1)).map(
    lambda drawn: np.random.default_rng(drawn[1]).random(drawn[0])
)
ranges = st.sampled_from([0.0, 0.021, 0.117, 0.43, 2.0])


@given(lines, ranges)
def test_perron_matrix_is_made_of_the_laplacian(states: np.ndarray, rho: float) -> None:
    adjacency = np.abs(states[:, None] - states) <= rho
    degrees = adjacency.sum(axis=1)
    matrix = laplacian(states, rho)
    np.testing.assert_array_equal(matrix, np.diag(degrees) - adjacency)
    np.testing.assert_allclose(
        perron_matrix(states, rho), np.eye(len(states)) - matrix / degrees[:, None], atol=1e-15
    )


@given(lines, ranges)
def test_perron_matrix_is_row_stochastic_and_moves_the_line(states: np.ndarray, rho: float) -> None:
    matrix = perron_matrix(states, rho)
    assert matrix.shape == (len(states), len(states))
    assert (matrix >= 0).all()
    np.testing.assert_allclose(matrix.sum(axis=1), 1, atol=1e-14)
    assert (np.diag(matrix) > 0).all()
    scenario = LineScenario(num_agents=len(states), predator_position=None, max_steps=1)
    moved = simulate_line(scenario, rho, initial_state=states).states[1]
    np.testing.assert_allclose(matrix @ states, moved, atol=1e-14)


@given(lines, ranges)
def test_laplacian_counts_components(states: np.ndarray, rho: float) -> None:
    matrix = laplacian(states, rho)
    np.testing.assert_array_equal(matrix, matrix.T)
    np.testing.assert_array_equal(matrix.sum(axis=1), 0)
    zeros = int((np.linalg.eigvalsh(matrix) < 1e-9).sum())
    assert zeros == reference.line_components(states, rho)
    assert zeros == reference.num_components(matrix < 0)
