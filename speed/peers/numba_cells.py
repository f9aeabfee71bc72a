"""The peer in Numba: a cell list that sorts agents into cells and compares them with nine cells.

It has an array per coordinate and no branch in the inner loop, so that the compiler vectorizes it.
``fastmath`` lets the compiler reorder sums.
"""

import numpy as np
from numba import njit

from speed.peers import Floats, Model, Peer, one_by_one

Vector = tuple[float, float]


@njit
def _scaled(x: float, y: float, length: float) -> Vector:
    norm = np.sqrt(x * x + y * y)
    if norm > 0.0:
        return length * x / norm, length * y / norm
    return 0.0, 0.0


@njit(fastmath=True, inline="always")
def _sum_in_range(columns: tuple[Floats, ...], k: int, low: int, high: int, rho: float) -> Vector:
    x, y, vx, vy = columns
    sum_x, sum_y = 0.0, 0.0
    for j in range(low, high):
        dx, dy = x[j] - x[k], y[j] - y[k]
        is_near = dx * dx + dy * dy <= rho * rho
        sum_x += vx[j] if is_near else 0.0
        sum_y += vy[j] if is_near else 0.0
    return sum_x, sum_y


@njit(fastmath=True)
def _cells(r: Floats, v: Floats, interaction_range: float, sums: Floats) -> None:
    n = len(r)
    low_x, low_y = r[:, 0].min(), r[:, 1].min()
    width, height = r[:, 0].max() - low_x, r[:, 1].max() - low_y
    # Cells are so large that there are about as many cells as agents; more cells would be slower.
    side = max(interaction_range, np.sqrt(width * height / n), 1e-9)
    columns, rows = int(width / side) + 1, int(height / side) + 1
    cell = np.empty(n, np.int64)
    for i in range(n):
        cell[i] = int((r[i, 1] - low_y) / side) * columns + int((r[i, 0] - low_x) / side)
    start = np.bincount(cell, minlength=columns * rows + 1).cumsum()
    order = np.empty(n, np.int64)
    for i in range(n - 1, -1, -1):  # counting sort, from the back
        start[cell[i]] -= 1
        order[start[cell[i]]] = i
    ordered = r[order, 0], r[order, 1], v[order, 0], v[order, 1]
    for k in range(n):
        i = order[k]
        row, column = cell[i] // columns, cell[i] % columns
        left, right = max(column - 1, 0), min(column + 1, columns - 1)
        sums[i] = 0.0
        for near in range(max(row - 1, 0), min(row + 1, rows - 1) + 1):
            # Neighboring cells of a row are contiguous in the sorted arrays.
            first, last = start[near * columns + left], start[near * columns + right + 1]
            x, y = _sum_in_range(ordered, k, first, last, interaction_range)
            sums[i, 0] += x
            sums[i, 1] += y


@njit
def _mean_distance(r: Floats, predator_x: float, predator_y: float) -> float:
    total = 0.0
    for i in range(len(r)):
        total += np.sqrt((r[i, 0] - predator_x) ** 2 + (r[i, 1] - predator_y) ** 2)
    return total / len(r)


@njit
def _run(model: Model, r: Floats, v: Floats, rho: float, steps: int) -> tuple[Floats, float]:
    r, v = r.copy(), v.copy()
    sums = np.empty_like(v)
    predator_x, predator_y = model.predator_position
    gain = model.time_step / model.mass
    minimum = _mean_distance(r, predator_x, predator_y)
    for _ in range(steps):
        _cells(r, v, rho, sums)
        for i in range(len(r)):
            # The sum has the same direction as the mean.
            force_x, force_y = _scaled(sums[i, 0], sums[i, 1], model.speed)
            offset_x, offset_y = r[i, 0] - predator_x, r[i, 1] - predator_y
            if offset_x * offset_x + offset_y * offset_y <= model.predator_range**2:
                escape_x, escape_y = _scaled(offset_x, offset_y, model.repulsion_strength)
                force_x += escape_x
                force_y += escape_y
            r[i, 0] += model.time_step * v[i, 0]
            r[i, 1] += model.time_step * v[i, 1]
            pushed_x, pushed_y = v[i, 0] + gain * force_x, v[i, 1] + gain * force_y
            if pushed_x != 0.0 or pushed_y != 0.0:
                v[i, 0], v[i, 1] = _scaled(pushed_x, pushed_y, model.speed)
        predator_x += model.time_step * model.predator_velocity[0]
        predator_y += model.time_step * model.predator_velocity[1]
        minimum = min(minimum, _mean_distance(r, predator_x, predator_y))
    return r, minimum


PEERS = (Peer("Numba, cell list, fastmath", one_by_one(_run)),)
