"""Neighbor graphs: pairs and connected components of a flock, Laplacian and Perron matrix of a line."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_floats, as_vector
from flockesc_env.common.errors import InputError
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario


def component_labels(
    scenario: FlockScenario | str | None,
    positions: ArrayLike,
    interaction_range: ArrayLike,
    *,
    velocities: ArrayLike | None = None,
) -> NDArray[np.int64]:
    """Return the connected component of every agent.

    Components are weakly connected: an edge connects two agents if at least one listens to the other. All
    positions count. At time t of a ``Trajectory``, ``(run.caught_at < 0) | (run.caught_at > t)`` are the
    agents that are not caught, which ``run.num_components`` counts.

    Args:
        scenario: the scenario that defines neighbors, or a preset's name; ``None``: metric neighbors. With
            ``frozen_graph`` the graph is computed from these positions.
        positions: r_i in m, shape (n, 2) or (n, 3).
        interaction_range: rho, a scalar or one per agent, shape (n,), in m or in the unit of the neighbor
            rule.
        velocities: v_i in m/s, same shape as ``positions``; required if the scenario has a blind angle.

    Returns:
        Labels, shape (n,): the smallest index of an agent in the same component.

    Examples:
        >>> component_labels(None, [[0, 0], [1, 0], [9, 0]], 2.0)
        array([0, 0, 2])
    """
    return _core.component_labels(_core_arguments(scenario, positions, interaction_range, velocities))


def neighbor_pairs(
    scenario: FlockScenario | str | None,
    positions: ArrayLike,
    interaction_range: ArrayLike,
    *,
    velocities: ArrayLike | None = None,
) -> NDArray[np.int64]:
    """Return all pairs (i, j) of different agents such that agent i listens to agent j.

    The arguments are those of ``component_labels``.

    Returns:
        Pairs in lexicographic order, shape (m, 2).

    Examples:
        >>> neighbor_pairs(None, [[0, 0], [1, 0], [9, 0]], 2.0)
        array([[0, 1],
               [1, 0]])
    """
    return _core.neighbor_pairs(_core_arguments(scenario, positions, interaction_range, velocities))


def _core_arguments(
    scenario: FlockScenario | str | None,
    positions: ArrayLike,
    interaction_range: ArrayLike,
    velocities: ArrayLike | None,
) -> tuple[str | None, FloatArray, FloatArray, FloatArray]:
    if scenario is not None:
        scenario = as_scenario(scenario, FlockScenario)
    points = as_floats(positions, "positions")
    if points.ndim != 2 or points.shape[1] not in {2, 3} or not len(points):
        raise InputError("positions", "shape (n, 2) or (n, 3) with n >= 1", f"shape {points.shape}")
    if scenario is not None and points.shape[1] != scenario.dimension:
        expected = f"shape (n, {scenario.dimension}), because the dimension is {scenario.dimension}"
        raise InputError("positions", expected, f"shape {points.shape}")
    if velocities is None and scenario is not None and scenario.blind_angle > 0:
        raise InputError("velocities", f"shape {points.shape}, for the scenario's blind angle", None)
    moves = np.zeros_like(points) if velocities is None else as_floats(velocities, "velocities", points.shape)
    ranges = as_floats(interaction_range, "interaction_range", least=0.0)
    if ranges.shape not in {(), (len(points),)}:
        expected = f"a scalar or shape ({len(points)},)"
        raise InputError("interaction_range", expected, f"shape {ranges.shape}")
    document = None if scenario is None else scenario.to_json()
    return document, points, moves, np.atleast_1d(ranges)


def perron_matrix(states: ArrayLike, interaction_range: float) -> FloatArray:
    """Return the Perron matrix P = I - Delta^-1 L of a line (Eq. 2), shape (n, n); its rows sum to 1.

    Args:
        states: positions x_i of the agents, shape (n,).
        interaction_range: rho, at least 0.
    """
    return _line_matrix(states, interaction_range, is_perron=True)


def laplacian(states: ArrayLike, interaction_range: float) -> FloatArray:
    """Return the Laplacian L of the graph with edges ``|x_i - x_j| <= rho``, shape (n, n).

    The arguments are those of ``perron_matrix``.
    """
    return _line_matrix(states, interaction_range, is_perron=False)


def _line_matrix(states: ArrayLike, interaction_range: float, *, is_perron: bool) -> FloatArray:
    rho = float(as_floats(interaction_range, "interaction_range", (), least=0.0))
    return _core.line_matrix(as_vector(states, "states"), rho, is_perron)
