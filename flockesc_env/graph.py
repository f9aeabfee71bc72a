"""Matrices of the line's neighbor graph (paper, Section II)."""

from __future__ import annotations

from numpy.typing import ArrayLike

from flockesc_env import _core
from flockesc_env._checks import FloatArray, as_floats
from flockesc_env.errors import ArgumentError


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
