"""Neighbor graphs: pairs and components of a flock, matrices of a line (paper, Section II)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_floats
from flockesc_env.common.errors import ArgumentError
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario


def component_labels(
    scenario: FlockScenario | str | None,
    positions: ArrayLike,
    interaction_range: ArrayLike,
    *,
    velocities: ArrayLike | None = None,
) -> NDArray[np.int64]:
    """Return the connected component of every agent, named by its lowest agent index, shape (n,).

    Components are weak: an edge connects two agents if one of them listens to the other.

    Args:
        scenario: the scenario whose neighbor rule applies, or a preset's name; ``None``: agents within range
            are neighbors. A frozen graph is that of these positions.
        positions: r_i in m, shape (n, 2) or (n, 3).
        interaction_range: rho in m, or in the unit of the neighbor rule, a scalar or shape (n,).
        velocities: v_i in m/s, shape of ``positions``; needed if the scenario has a blind angle.

    Raises:
        ArgumentError: for a wrong shape, an entry that is not finite, or a negative range.
        ScenarioError: if no preset of a flock has the name.
    """
    return _core.component_labels(*_moment(scenario, positions, interaction_range, velocities))


def neighbor_pairs(
    scenario: FlockScenario | str | None,
    positions: ArrayLike,
    interaction_range: ArrayLike,
    *,
    velocities: ArrayLike | None = None,
) -> NDArray[np.int64]:
    """Return all pairs (i, j) of different agents such that i listens to j, in order, shape (m, 2).

    Args:
        scenario: as in ``component_labels``, and likewise the other arguments.
        positions: likewise.
        interaction_range: likewise.
        velocities: likewise.

    Raises:
        ArgumentError: as ``component_labels``.
        ScenarioError: as ``component_labels``.
    """
    return _core.neighbor_pairs(*_moment(scenario, positions, interaction_range, velocities))


def _moment(
    named: FlockScenario | str | None,
    positions: ArrayLike,
    interaction_range: ArrayLike,
    velocities: ArrayLike | None,
) -> tuple[str | None, FloatArray, FloatArray, FloatArray]:
    scenario = as_scenario(named, FlockScenario) if isinstance(named, str) else named
    if scenario is not None:
        scenario = as_scenario(scenario, FlockScenario)
    points = as_floats(positions, "positions")
    if points.ndim != 2 or points.shape[1] not in {2, 3} or not len(points):
        raise ArgumentError("positions", "shape (n, 2) or (n, 3) with n >= 1", f"shape {points.shape}")
    if scenario is not None and points.shape[1] != scenario.dimension:
        expected = f"shape (n, {scenario.dimension}), as the scenario's dimension"
        raise ArgumentError("positions", expected, f"shape {points.shape}")
    if velocities is None and scenario is not None and scenario.blind_angle > 0:
        raise ArgumentError("velocities", f"shape {points.shape}, as there is a blind angle", None)
    moves = np.zeros_like(points) if velocities is None else as_floats(velocities, "velocities", points.shape)
    ranges = as_floats(interaction_range, "interaction_range")
    if ranges.shape not in {(), (len(points),)}:
        expected = f"a scalar or shape ({len(points)},)"
        raise ArgumentError("interaction_range", expected, f"shape {ranges.shape}")
    document = None if scenario is None else scenario.to_json()
    return document, points, moves, np.atleast_1d(ranges)


def perron_matrix(states: ArrayLike, interaction_range: float) -> FloatArray:
    """Return P = I - Delta^-1 L of Eq. 2 for a line at ``states``, shape (n, n); rows sum to 1.

    Raises:
        ArgumentError: if the states are not a vector of finite numbers, or the range is not a number >= 0.
    """
    return _core.perron_matrix(*_line(states, interaction_range))


def laplacian(states: ArrayLike, interaction_range: float) -> FloatArray:
    """Return L, the Laplacian of the graph with an edge where |x_i - x_j| <= rho, shape (n, n).

    Raises:
        ArgumentError: if the states are not a vector of finite numbers, or the range is not a number >= 0.
    """
    return _core.laplacian(*_line(states, interaction_range))


def _line(states: ArrayLike, interaction_range: float) -> tuple[FloatArray, float]:
    array = as_floats(states, "states")
    if array.ndim != 1 or not array.size:
        raise ArgumentError("states", "shape (n,) with n >= 1", f"shape {array.shape}")
    return array, float(as_floats(interaction_range, "interaction_range", (), least=0.0))
