"""Cameras: from points of the world to pixels. The plane is seen from above, space in perspective."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from flockesc_env.common.checks import FloatArray

VIEW_ASPECT = 1.4
"""Width over height of the upper part of a picture, which shows the flock."""

_AZIMUTH, _ELEVATION = np.deg2rad([-62.0, 24.0])
_DISTANCE = 1.5
"""Distance from the camera to the center of the box, over the diagonal of the box."""

_BORDER = 0.03
"""Margin around the box, over the height of the picture."""


class Rect(NamedTuple):
    """A part of a picture, in px; y points down."""

    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Return the x coordinate of the right edge."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """Return the y coordinate of the bottom edge."""
        return self.top + self.height

    @property
    def center(self) -> FloatArray:
        """Return the point in the middle."""
        return np.array([self.left + self.width / 2, self.top + self.height / 2])


Camera = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Maps points of the world, shape (k, D) in m, to pixels x and y, shape (k, 2), and the px per m there."""


def camera(view: FloatArray, rect: Rect) -> Camera:
    """Return a camera that shows the box from corner ``view[0]`` to corner ``view[1]``, in m, in ``rect``."""
    return _flat(view, rect) if view.shape[1] == 2 else _perspective(view, rect)


def grow(view: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the smallest box around ``view`` and the box from ``low`` to ``high``, shape (2, D), in m.

    In the plane it has the aspect of a picture, so that a growing view always includes the last one.
    """
    low, high = np.minimum(view[0], low), np.maximum(view[1], high)
    if len(low) == 2:
        extent = high - low
        height = max(extent[0] / VIEW_ASPECT, extent[1])
        slack = (np.array([VIEW_ASPECT * height, height]) - extent) / 2
        low, high = low - slack, high + slack
    return np.stack([low, high])


def _flat(view: FloatArray, rect: Rect) -> Camera:
    """Return a camera above the plane: y points up, and the scale is the same everywhere."""
    width, height = view[1] - view[0]
    scale = float(min(rect.width / width, rect.height / height))
    middle = view.mean(axis=0)

    def project(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        return rect.center + (points - middle) * (scale, -scale), np.full(len(points), scale)

    return project


def _perspective(view: FloatArray, rect: Rect) -> Camera:
    """Return a camera beside and above a space, z up; the box fills the picture."""
    cos, sin = np.cos(_ELEVATION), np.sin(_ELEVATION)
    toward = np.array([cos * np.cos(_AZIMUTH), cos * np.sin(_AZIMUTH), sin])
    right = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])
    axes = np.stack([right, np.cross(toward, right), toward])
    target = view.mean(axis=0)
    distance = _DISTANCE * float(np.linalg.norm(view[1] - view[0]))

    def seen(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y, z = axes @ (points - target).T
        depth = distance - z
        return np.stack([x, -y], axis=1) / depth[:, np.newaxis], depth

    corners, _ = seen(box_corners(view))
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = np.array([rect.width, rect.height]) - 2 * _BORDER * rect.height
    zoom = float(np.min(room / (high - low)))
    middle = (low + high) / 2

    def project(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        pixels, depth = seen(points)
        return rect.center + zoom * (pixels - middle), zoom / depth

    return project


def box_corners(view: FloatArray) -> FloatArray:
    """Return the corners of a box, shape (8, 3): the four of the floor in order, then the four above them."""
    (x0, y0, z0), (x1, y1, z1) = view
    floor = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return np.array([(x, y, z) for z in (z0, z1) for x, y in floor])
