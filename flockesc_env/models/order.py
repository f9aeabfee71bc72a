"""Measures of order of flocks and measured tracks: polarization, rotation, distances, density, correlation.

Distances, density, correlation and autocorrelation need the extra ``analysis``.
"""

from __future__ import annotations

from collections.abc import Callable
from inspect import cleandoc
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray, as_array, as_floats
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.models.simulate import Trajectory, check_recorded

Measure = Callable[..., FloatArray]
_ARGUMENTS = """
Args:
    tracks: a ``Trajectory``, whose caught agents do not count, or positions in m, shape (T, n, D) or
        (n, D). An agent with a NaN does not count at that time.
    velocities: velocities in m/s, of the shape of positions; ``None``: of the trajectory, or not needed.
    side: side of a periodic domain in m; ``None``: an open domain, or that of the trajectory.

Returns:
    The measure at every time, shape (T,), or at the only one, shape ().
"""
_STATIC = {"nearest_neighbor_distance", "density"}
"""Measures that need no velocities."""


def over_time(measure: Callable[[FloatArray, FloatArray, float | None], float]) -> Measure:
    """Return a measure of tracks from one of the agents at one time: positions, velocities, ``side``."""

    def measured(
        tracks: Trajectory | ArrayLike, velocities: ArrayLike | None = None, *, side: float | None = None
    ) -> FloatArray:
        if velocities is None and measure.__name__ not in _STATIC and not isinstance(tracks, Trajectory):
            raise InputError("velocities", "an array in m/s", None)
        positions, moves, periodic, counted = _checked(tracks, velocities, side)
        found = np.empty(counted.shape[:-1])
        for time in np.ndindex(found.shape):
            here = counted[time]
            found[time] = measure(positions[time][here], moves[time][here], periodic)
        return found

    measured.__name__, measured.__qualname__ = measure.__name__, measure.__qualname__
    measured.__doc__ = f"{cleandoc(measure.__doc__ or '')}\n{_ARGUMENTS}"
    return measured


@over_time
def polarization(_: FloatArray, velocities: FloatArray, __: float | None) -> float:
    """Return the norm of the mean heading (Vicsek et al. 1995, PRL 75, 1226); 0 without agents."""
    return float(np.linalg.norm(unit(velocities).sum(axis=0)) / max(len(velocities), 1))


@over_time
def rotation(points: FloatArray, velocities: FloatArray, side: float | None) -> float:
    """Return the group rotation (Couzin et al. 2002, J Theor Biol 218, 1).

    It is the norm of the mean over agents of unit(r_i - c) x unit(v_i), where c is the centroid: 1 in a
    perfect mill, 0 in a swarm or a parallel flock. A periodic domain, which has no centroid, raises
    ``InputError``.
    """
    if side is not None:
        raise InputError("side", "None for rotation: a periodic domain has no centroid", side)
    count, to_space = max(len(points), 1), ((0, 0), (0, 3 - points.shape[1]))
    arms = points - points.sum(axis=0) / count
    moments = np.cross(np.pad(unit(arms), to_space), np.pad(unit(velocities), to_space))
    return float(np.linalg.norm(moments.sum(axis=0) / count, axis=-1))


def nearest_neighbor_distances(tracks: Trajectory | ArrayLike, *, side: float | None = None) -> FloatArray:
    """Return each agent's distance in m to the nearest other agent (Clark and Evans 1954, Ecology 35, 445).

    The arguments are those of ``density``. The shape is (T, n) or (n,). Distances are NaN for agents that do
    not count and infinite for the last one.
    """
    positions, _, periodic, counted = _checked(tracks, None, side)
    distances = np.full(counted.shape, np.nan)
    for time in np.ndindex(counted.shape[:-1]):
        distances[time][counted[time]] = _nearest(positions[time][counted[time]], periodic)
    return distances


@over_time
def nearest_neighbor_distance(points: FloatArray, _: FloatArray, side: float | None) -> float:
    """Return the mean over agents of ``nearest_neighbor_distances``; NaN without agents."""
    return float(_nearest(points, side).mean()) if len(points) else np.nan


@over_time
def density(points: FloatArray, _: FloatArray, side: float | None) -> float:
    """Return the number of agents per m^D.

    In a periodic domain it refers to the domain (Vicsek et al. 1995, PRL 75, 1226), otherwise to the convex
    hull of the agents (Cavagna et al. 2008, Anim Behav 76, 237). It is infinite if the hull has no volume,
    and NaN if no agent is left.
    """
    require("analysis", ["scipy"])
    from scipy.spatial import ConvexHull, QhullError  # optional and slow to import

    if side is None and not len(points):
        return np.nan
    try:
        volume = float(ConvexHull(points).volume) if side is None else side ** points.shape[1]
    except QhullError:  # too few agents, or all on a line or a plane
        volume = 0.0
    return len(points) / volume if volume else np.inf


@over_time
def correlation_length(points: FloatArray, velocities: FloatArray, side: float | None) -> float:
    """Return the correlation length in m of the velocity fluctuations (Cavagna et al. 2010, PNAS 107, 11865).

    It is the smallest distance at which C(r), the mean of u_i . u_j over pairs at distance r, is zero, where
    u_i is v_i minus the mean velocity. Distances are grouped in bins as wide as the mean distance between
    nearest neighbors, and C is interpolated linearly from C(0), the mean of u_i . u_i. Pairs farther apart
    than n bins share the last bin, so memory is proportional to n. Lengths are NaN if all velocities or all
    positions are equal.
    """
    count = len(points)
    width = _nearest(points, side).mean() if count > 1 else 0.0
    fluctuations = velocities - velocities.mean(axis=0) if count else velocities
    strength = (fluctuations**2).sum()
    if width == 0 or strength == 0:
        return np.nan
    sums = np.zeros((3, count + 1))  # of ones, distances and products, a column per bin
    columns = points.T.copy(), fluctuations.T.copy()
    for agent in range(count - 1):
        distances, products = _with_later_agents(*columns, agent, side)
        bins = np.minimum(np.rint(distances / width), count).astype(np.intp)
        for row, terms in zip(sums, (1.0, distances, products), strict=True):
            np.add.at(row, bins, terms)
    sums = sums[:, sums[0] > 0]
    r, c = np.hstack([[[0.0], [strength / count]], sums[1:] / sums[0]])
    # The fluctuations sum to 0, so the products of pairs do not have a positive sum: C has a zero.
    at = int(np.argmax(c <= 0))
    return float(r[at - 1] + (r[at] - r[at - 1]) * c[at - 1] / (c[at - 1] - c[at]))


MEASURES: Final = {
    "polarization": polarization,
    "rotation": rotation,
    "nearest_neighbor_distance": nearest_neighbor_distance,
    "density": density,
    "correlation_length": correlation_length,
}
"""Measures with one number per time, by name."""


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


def autocorrelation_time(series: ArrayLike) -> float:
    """Return the integrated autocorrelation time 1 + 2 sum_t C(t) / C(0), in entries of the series.

    The mean of T entries has the variance of T / time independent ones. The sum ends at the first t that is
    at least five times as large (Sokal 1997, in: Functional Integration, p. 131). It is NaN if all values are
    equal.

    Args:
        series: values over time of one run, shape (T,), or of several, shape (runs, T), which share one mean.
    """
    require("analysis", ["scipy"])
    from scipy.signal import correlate  # optional and slow to import

    given = as_floats(series, "series")
    if given.ndim not in {1, 2} or not given.size:
        raise InputError("series", "shape (T,) or (runs, T) with at least one entry", f"shape {given.shape}")
    runs = np.atleast_2d(given)
    lags = sum(correlate(run, run)[len(run) - 1 :] for run in runs - runs.mean())
    if np.ptp(runs) == 0:
        return np.nan
    times = 2 * np.cumsum(lags / lags[0]) - 1
    is_past = np.arange(len(times)) >= 5 * times
    return float(times[is_past.argmax() if is_past.any() else -1])


def _checked(
    tracks: Any, velocities: Any, side: float | None
) -> tuple[FloatArray, FloatArray, float | None, NDArray[np.bool]]:
    """Return positions, velocities (0 if not given), side and which agents count, shape (n,) or (T, n)."""
    if isinstance(tracks, Trajectory):
        if velocities is not None or side is not None:
            raise InputError("tracks", "positions, if velocities or side are given", tracks)
        check_recorded(tracks, "tracks", "positions", "velocities")
        return tracks.positions, tracks.velocities, tracks.scenario.periodic_side, ~tracks.is_caught
    positions = _with_gaps(tracks, "tracks")
    if positions.ndim not in {2, 3} or positions.shape[-1] not in {2, 3} or not positions.size:
        raise InputError("tracks", "a Trajectory or shape (n, D) or (T, n, D)", f"shape {positions.shape}")
    moves = np.zeros_like(positions) if velocities is None else _with_gaps(velocities, "velocities")
    if moves.shape != positions.shape:
        raise InputError("velocities", f"shape {positions.shape}", f"shape {moves.shape}")
    if side is not None and not (side := float(as_floats(side, "side", ()))) > 0:
        raise InputError("side", "a number above 0", side)
    return positions, moves, side, np.asarray(~np.isnan(positions + moves).any(axis=-1))


def _with_gaps(value: Any, field: str) -> FloatArray:
    """Return an array of finite numbers and NaN."""
    array = as_array(value, field)
    gaps = np.isnan(array) if array.dtype.kind == "f" else False
    floats = as_floats(array if gaps is False else np.where(gaps, 0, array), field)
    floats[gaps] = np.nan
    return floats


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
    if side is not None:
        points = points % side % side  # a tiny negative number modulo side is side
    distances: FloatArray = cKDTree(points, boxsize=side).query(points, k=2)[0][:, 1]
    return distances


def _with_later_agents(points: FloatArray, velocities: FloatArray, i: int, side: float | None) -> FloatArray:
    """Return the distances r_ij and the products v_i . v_j for all j > i, shape (2, n - i - 1)."""
    offsets = points[:, i, None] - points[:, i + 1 :]
    if side is not None:
        offsets -= side * np.rint(offsets / side)
    products = velocities[:, i, None] * velocities[:, i + 1 :]
    return np.stack([np.linalg.norm(offsets, axis=0), products.sum(axis=0)])
