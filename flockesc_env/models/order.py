"""Measures of order of a recorded flock: rotation, distances, density, correlation, Binder cumulant.

Caught agents do not count. ``Trajectory.polarization`` is recorded with every run. Distances, density and
correlation need the extra ``analysis``.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray, as_floats, as_instance
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.models.simulate import Trajectory, check_recorded

_BLOCK = 2**18
"""Pairs of agents that are in memory together."""


def rotation(trajectory: Trajectory) -> FloatArray:
    """Return the group rotation (Couzin et al. 2002, J Theor Biol 218, 1), shape (T + 1,).

    It is the norm of the mean over agents of unit(r_i - c) x unit(v_i), where c is the centroid: 1 in a
    perfect mill, 0 in a swarm or a parallel flock. A run in a periodic domain, which has no centroid, raises
    ``InputError``.
    """
    run, counted = _checked(trajectory)
    if run.scenario.periodic_side is not None:
        raise InputError("trajectory", "a run in an open domain", "one in a periodic domain")
    alive = counted[..., np.newaxis]
    count = np.maximum(alive.sum(axis=1, keepdims=True), 1)
    center = (run.positions * alive).sum(axis=1, keepdims=True) / count
    to_space = ((0, 0), (0, 0), (0, 3 - run.scenario.dimension))
    arms, headings = (np.pad(unit(each), to_space) for each in (run.positions - center, run.velocities))
    # A caught agent has velocity 0 and adds 0 to the sum.
    found: FloatArray = np.linalg.norm(np.cross(arms, headings).sum(axis=1) / count[:, 0], axis=-1)
    return found


def nearest_neighbor_distances(trajectory: Trajectory) -> FloatArray:
    """Return each agent's distance in m to the nearest other agent (Clark and Evans 1954, Ecology 35, 445).

    The shape is (T + 1, n). Distances are NaN for caught agents and infinite for the last agent left.
    """
    run, alive = _checked(trajectory)
    distances = np.full(alive.shape, np.nan)
    for time, points in enumerate(_points(run, alive)):
        distances[time, alive[time]] = _nearest(points, run.scenario.periodic_side)
    return distances


def density(trajectory: Trajectory) -> FloatArray:
    """Return the number of agents per m^D, shape (T + 1,).

    In a periodic domain it refers to the domain (Vicsek et al. 1995, PRL 75, 1226), otherwise to the convex
    hull of the agents (Cavagna et al. 2008, Anim Behav 76, 237). It is infinite if the hull has no volume,
    and NaN if no agent is left.
    """
    run, alive = _checked(trajectory)
    side = run.scenario.periodic_side
    volumes = (
        np.array([_hull_volume(points) for points in _points(run, alive)])
        if side is None
        else np.float64(side) ** run.scenario.dimension
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        found: FloatArray = alive.sum(axis=1) / volumes
    return found


def correlation_length(trajectory: Trajectory) -> FloatArray:
    """Return the correlation length in m of the velocity fluctuations (Cavagna et al. 2010, PNAS 107, 11865).

    It is the smallest distance at which C(r), the mean of u_i . u_j over pairs at distance r, is zero, where
    u_i is v_i minus the mean velocity. Distances are grouped in bins as wide as the mean distance between
    nearest neighbors, and C is interpolated linearly from C(0), the mean of u_i . u_i. The shape is (T + 1,).
    Lengths are NaN if all velocities or all positions are equal.
    """
    run, alive = _checked(trajectory)
    pairs = zip(_points(run, alive), run.velocities, alive, strict=True)
    side = run.scenario.periodic_side
    return np.array([_first_zero(points, velocities[here], side) for points, velocities, here in pairs])


def binder_cumulant(order_parameter: ArrayLike) -> float:
    """Return the Binder cumulant 1 - <v^4> / (3 <v^2>^2) (Binder 1981, Z Phys B 43, 119).

    It is 2/3 for a constant order parameter and 1/3 for the norm of a Gaussian vector in the plane
    (disorder). A minimum below the disordered value is a sign of a discontinuous transition. It is NaN if
    all values are 0.

    Args:
        order_parameter: values v, for example polarizations of several flocks over time; the means <> run
            over all of them.
    """
    values = as_floats(order_parameter, "order_parameter")
    if not values.size:
        raise InputError("order_parameter", "at least one value", "none")
    # The cumulant does not depend on the unit. In this unit the powers are finite.
    squares = np.ldexp(values, -np.frexp(np.abs(values).max())[1]) ** 2
    with np.errstate(invalid="ignore"):
        return float(1 - (squares**2).mean() / (3 * squares.mean() ** 2))


def _checked(trajectory: Any) -> tuple[Trajectory, NDArray[np.bool]]:
    """Return a run after a check of its type, and which agents are not caught at each time, (T + 1, n)."""
    run = as_instance(trajectory, "trajectory", Trajectory)
    check_recorded(run, "trajectory", "positions", "velocities")
    return run, ~run.is_caught


def _points(run: Trajectory, alive: NDArray[np.bool]) -> Iterator[FloatArray]:
    """Yield the positions of the agents that are not caught, for each time."""
    return (positions[here] for positions, here in zip(run.positions, alive, strict=True))


def unit(vectors: FloatArray) -> FloatArray:
    """Return the directions of vectors, whose axes are the last axis; 0 stays 0."""
    norms = np.linalg.norm(vectors, axis=-1, keepdims=True)
    directions: FloatArray = np.divide(vectors, norms, out=np.zeros_like(vectors), where=norms > 0)
    return directions


def _nearest(points: FloatArray, side: float | None) -> FloatArray:
    require("analysis", ["scipy"])
    from scipy.spatial import cKDTree  # optional and slow to import

    if not len(points):
        return np.empty(0)
    distances: FloatArray = cKDTree(points, boxsize=side).query(points, k=2)[0][:, 1]
    return distances


def _hull_volume(points: FloatArray) -> float:
    require("analysis", ["scipy"])
    from scipy.spatial import ConvexHull, QhullError  # optional and slow to import

    if not len(points):
        return 0.0
    try:
        return float(ConvexHull(points).volume)
    except QhullError:  # too few agents, or all on a line or a plane
        return 0.0


def _first_zero(points: FloatArray, velocities: FloatArray, side: float | None) -> float:
    """Return the distance at which the correlation of velocity fluctuations is first zero, or NaN."""
    width = _nearest(points, side).mean() if len(points) > 1 else 0.0
    fluctuations = velocities - velocities.mean(axis=0) if len(points) else velocities
    strength = (fluctuations**2).sum()
    if width == 0 or strength == 0:
        return np.nan
    bins, sums = np.empty(0), np.empty((3, 0))  # of ones, distances and products, a column per bin
    rows, columns = max(1, _BLOCK // len(points)), (points.T.copy(), fluctuations.T.copy())
    for start in range(0, len(points) - 1, rows):
        block = range(start, min(start + rows, len(points) - 1))
        pairs = [_with_later_agents(*columns, index, side) for index in block]
        distances, products = np.concatenate(pairs, axis=1)
        own, places = np.unique(np.rint(distances / width), return_inverse=True)
        before, bins = bins, np.union1d(bins, own)
        grown = np.zeros((3, len(bins)))
        grown[:, np.searchsorted(bins, before)] = sums
        sums, places = grown, np.searchsorted(bins, own)[places]
        for row, terms in zip(sums, (1.0, distances, products), strict=True):
            np.add.at(row, places, terms)  # in the order of the pairs, for any size of a block
    r, c = np.hstack([[[0.0], [strength / len(points)]], sums[1:] / sums[0]])
    # The fluctuations sum to 0, so the products of pairs do not have a positive sum: C has a zero.
    at = int(np.argmax(c <= 0))
    return float(r[at - 1] + (r[at] - r[at - 1]) * c[at - 1] / (c[at - 1] - c[at]))


def _with_later_agents(points: FloatArray, velocities: FloatArray, i: int, side: float | None) -> FloatArray:
    """Return the distances r_ij and the products v_i . v_j for all j > i, shape (2, n - i - 1)."""
    offsets = points[:, i, None] - points[:, i + 1 :]
    if side is not None:
        offsets -= side * np.rint(offsets / side)
    products = velocities[:, i, None] * velocities[:, i + 1 :]
    return np.stack([np.linalg.norm(offsets, axis=0), products.sum(axis=0)])
