"""The neighbor graph: components of a flock; matrices of a line (paper, Section II)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env._checks import FloatArray, as_floats
from flockesc_env.errors import ArgumentError


def component_labels(positions: ArrayLike, interaction_range: ArrayLike) -> NDArray[np.int64]:
    """Return the connected component of every agent, named by the lowest index in it, shape (n,).

    Agents within each other's range are neighbors; with one range per agent it is enough that one listens to
    the other (weak components).

    Args:
        positions: r_i in m, shape (n, 2) or (n, 3).
        interaction_range: rho in m, a scalar or shape (n,).

    Raises:
        ArgumentError: for a wrong shape, an entry that is not finite, or a negative range.
    """
    points = as_floats(positions, "positions")
    if points.ndim != 2 or points.shape[1] not in {2, 3} or not len(points):
        raise ArgumentError("positions", "shape (n, 2) or (n, 3) with n >= 1", f"shape {points.shape}")
    ranges = as_floats(interaction_range, "interaction_range")
    if ranges.shape not in {(), (len(points),)}:
        raise ArgumentError(
            "interaction_range", f"a scalar or shape ({len(points)},)", f"shape {ranges.shape}"
        )
    return _core.component_labels(points, np.atleast_1d(ranges))


def perron_matrix(states: ArrayLike, interaction_range: float) -> FloatArray:
    """Return P = I - Delta^-1 L of Eq. 2 for a line at ``states``, shape (n, n); rows sum to 1.

    Raises:
        ArgumentError: for states that are no vector of finite numbers, or a bad range.
    """
    return _core.perron_matrix(*_line(states, interaction_range))


def laplacian(states: ArrayLike, interaction_range: float) -> FloatArray:
    """Return L, the Laplacian of the graph with an edge where |x_i - x_j| <= rho, shape (n, n).

    Raises:
        ArgumentError: for states that are no vector of finite numbers, or a bad range.
    """
    return _core.laplacian(*_line(states, interaction_range))


def _line(states: ArrayLike, interaction_range: float) -> tuple[FloatArray, float]:
    array = as_floats(states, "states")
    if array.ndim != 1 or not array.size:
        raise ArgumentError("states", "shape (n,) with n >= 1", f"shape {array.shape}")
    rho = float(as_floats(interaction_range, "interaction_range", ()))
    if rho < 0:
        raise ArgumentError("interaction_range", "a number of at least 0", rho)
    return array, rho
