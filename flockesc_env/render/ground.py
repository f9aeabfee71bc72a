"""The background of a flock: a grid, its scale and, in space, the box around the flock."""

from __future__ import annotations

import numpy as np

from flockesc_env.common.checks import FloatArray
from flockesc_env.render.camera import Camera, Rect, box_corners
from flockesc_env.render.canvas import Canvas
from flockesc_env.render.colors import FAINT_TEXT, GRID

_BOX_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)]


def draw_ground(canvas: Canvas, eye: Camera, view: FloatArray, rect: Rect) -> None:
    """Draw a grid in the plane or on the floor of the box ``view``, and the distance between its lines."""
    size = canvas.size
    _, (scale,) = eye(view.mean(axis=0, keepdims=True))
    in_space = view.shape[1] == 3
    spacing = nice((0.08 if in_space else 0.12) * size / scale)
    lines = _grid(view, spacing)
    if in_space:
        corners = box_corners(view)
        lines = np.concatenate([lines, [(corners[a], corners[b]) for a, b in _BOX_EDGES]])
    pixels, _ = eye(lines.reshape(-1, view.shape[1]))
    canvas.segments(pixels.reshape(-1, 2, 2), [GRID] * len(lines))
    text = f"{spacing:g} m"
    right, bottom = rect.right - 0.022 * size, rect.bottom - 0.022 * size
    if in_space:
        canvas.text(f"grid {text}", (right, bottom), FAINT_TEXT, "bottomright")
        return
    left, tick = right - spacing * float(scale), 0.008 * size
    bar = [[(left, bottom), (right, bottom)], *([(x, bottom - tick), (x, bottom)] for x in (left, right))]
    canvas.segments(np.array(bar), [FAINT_TEXT] * 3, 0.003 * size)
    canvas.text(text, ((left + right) / 2, bottom - 0.012 * size), FAINT_TEXT, "midbottom")


def nice(least: float) -> float:
    """Return the smallest of .., 0.2, 0.5, 1, 2, 5, 10, 20, .. that is at least ``least`` > 0."""
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(power * digit for digit in (1, 2, 5, 10) if power * digit >= least))


def _grid(view: FloatArray, spacing: float) -> FloatArray:
    """Return the lines of a grid on the floor of a box, shape (k, 2, D), through multiples of ``spacing``."""
    low, high = view
    lines = []
    for across in (0, 1):
        first, last = np.ceil(low[across] / spacing), np.floor(high[across] / spacing)
        for at in spacing * np.arange(first, last + 1):
            start, end = low.copy(), low.copy()
            start[across] = end[across] = at
            end[1 - across] = high[1 - across]
            lines.append((start, end))
    return np.array(lines).reshape(-1, 2, len(low))
