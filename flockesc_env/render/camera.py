"""Cameras: from points of the world to pixels. The plane is seen from above, space in perspective."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

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


class Camera(Protocol):
    """Maps points of the world to the picture."""

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the pixels of points and the scale there.

        Args:
            points: shape (k, D), in m.

        Returns:
            x and y in px, shape (k, 2), and px per m, shape (k,).
        """


def camera(view: FloatArray, rect: Rect) -> Camera:
    """Return a camera that shows the box from corner ``view[0]`` to corner ``view[1]``, in m, in ``rect``."""
    return FlatCamera(view, rect) if view.shape[1] == 2 else PerspectiveCamera(view, rect)


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


@dataclass(frozen=True, eq=False)
class FlatCamera:
    """The plane from above: y points up, and the scale is the same everywhere."""

    view: FloatArray
    rect: Rect

    @property
    def pixels_per_meter(self) -> float:
        """Return the scale."""
        width, height = self.view[1] - self.view[0]
        return float(min(self.rect.width / width, self.rect.height / height))

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the pixels of points and the scale there, as ``Camera.project``."""
        scale = self.pixels_per_meter
        center = np.array([self.rect.left + self.rect.width / 2, self.rect.top + self.rect.height / 2])
        pixels = center + (points - self.view.mean(axis=0)) * (scale, -scale)
        return pixels, np.full(len(points), scale)


class PerspectiveCamera:
    """Space in perspective, from the side and above, z up; the box fills the picture."""

    def __init__(self, view: FloatArray, rect: Rect) -> None:
        cos, sin = np.cos(_ELEVATION), np.sin(_ELEVATION)
        toward = np.array([cos * np.cos(_AZIMUTH), cos * np.sin(_AZIMUTH), sin])
        right = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])
        self._axes = np.stack([right, np.cross(toward, right), toward])
        self._target = view.mean(axis=0)
        self._distance = _DISTANCE * float(np.linalg.norm(view[1] - view[0]))
        self._zoom, self._middle, self._shift = 1.0, np.zeros(2), np.zeros(2)
        seen, _ = self.project(box_corners(view))
        low, high = seen.min(axis=0), seen.max(axis=0)
        room = np.array([rect.width, rect.height]) - 2 * _BORDER * rect.height
        self._zoom = float(np.min(room / (high - low)))
        self._middle = (low + high) / 2
        self._shift = np.array([rect.left + rect.width / 2, rect.top + rect.height / 2])

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the pixels of points and the scale there, as ``Camera.project``."""
        x, y, z = self._axes @ (points - self._target).T
        depth = self._distance - z
        seen = np.stack([x, -y], axis=1) / depth[:, np.newaxis]
        return self._shift + self._zoom * (seen - self._middle), self._zoom / depth


def box_corners(view: FloatArray) -> FloatArray:
    """Return the corners of a box, shape (8, 3): the four of the floor in order, then the four above them."""
    (x0, y0, z0), (x1, y1, z1) = view
    floor = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return np.array([(x, y, z) for z in (z0, z1) for x, y in floor])
