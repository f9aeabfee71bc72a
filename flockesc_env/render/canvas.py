"""Drawing with pygame, without a display. Only this file and ``window.py`` import pygame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import pygame
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.render.camera import Rect
from flockesc_env.render.colors import PAPER, Color, Colors

Image = NDArray[np.uint8]
"""Shape (height, width, 3)."""

Anchor = Literal[
    "topleft", "midtop", "topright", "midleft", "midright", "bottomleft", "midbottom", "bottomright"
]

TYPE = 0.07
"""Height of text, over the width of a picture: 9 px where two pictures share 390 px."""

_FINE = 2
"""Oversampling per axis: every pixel is the mean of this many drawn ones, squared, which smooths edges."""

_SPARE: dict[int, pygame.Surface] = {}
"""Surfaces to use again, by size: allocating one takes a sixth of the time of a picture."""


class Canvas:
    """A square picture. Points and lengths are in px and can be fractions; y points down.

    Args:
        size: width and height.
    """

    def __init__(self, size: int) -> None:
        self.size = size
        spare = _SPARE.pop(size, None)
        self._fine = pygame.Surface((_FINE * size, _FINE * size)) if spare is None else spare
        self._fine.set_clip(None)
        self._fine.fill(PAPER)
        self._texts: list[tuple[pygame.Surface, pygame.Rect]] = []

    def clip(self, rect: Rect | None) -> None:
        """Restrict later drawing to ``rect``; ``None`` lifts the restriction."""
        self._fine.set_clip(None if rect is None else pygame.Rect(*(round(_FINE * x) for x in rect)))

    def fill(self, rect: Rect, color: Color) -> None:
        """Fill a rectangle."""
        self._fine.fill(color, pygame.Rect(*(round(_FINE * x) for x in rect)))

    def polygons(self, points: FloatArray, colors: Iterable[Any]) -> None:
        """Fill polygons, shape (k, corners, 2), each in its color, with a rim in the color of the paper."""
        draw, fine = pygame.draw.polygon, self._fine
        for corners, color in zip(_plain(points), colors, strict=True):
            draw(fine, color, corners)
            draw(fine, PAPER, corners, 1)

    def segments(self, points: FloatArray, colors: Iterable[Any], width: float = 1.0) -> None:
        """Draw straight lines, shape (k, 2, 2), each in its color."""
        draw, fine, thickness = pygame.draw.line, self._fine, max(1, round(_FINE * width))
        for (start, end), color in zip(_plain(points), colors, strict=True):
            draw(fine, color, start, end, thickness)

    def path(self, points: FloatArray, color: Color, width: float = 1.0) -> None:
        """Draw a line through points, shape (k, 2)."""
        if len(points) > 1:
            pygame.draw.lines(self._fine, color, False, _plain(points), max(1, round(_FINE * width)))

    def dots(self, centers: FloatArray, radius: float, colors: Iterable[Any]) -> None:
        """Fill circles of one radius, centers of shape (k, 2), each in its color."""
        draw, fine, reach = pygame.draw.circle, self._fine, _FINE * radius
        for center, color in zip(_plain(centers), colors, strict=True):
            draw(fine, color, center, reach)

    def discs(self, centers: FloatArray, radii: FloatArray, colors: Colors, opacity: float) -> None:
        """Fill translucent circles, shapes (k, 2), (k,), (k, 3), which hide each other but nothing below."""
        if not len(centers):
            return
        low, high = (centers - radii[:, np.newaxis]).min(axis=0), (centers + radii[:, np.newaxis]).max(axis=0)
        around = pygame.Rect(*np.floor(_FINE * low).tolist(), *np.ceil(_FINE * (high - low) + 1).tolist())
        around = around.clip(self._fine.get_clip())
        layer = pygame.Surface(around.size, pygame.SRCALPHA)
        solid = np.column_stack([colors, np.full(len(colors), round(255 * opacity))]).tolist()
        places, reach = (_FINE * centers - around.topleft).tolist(), (_FINE * radii).tolist()
        for center, radius, color in zip(places, reach, solid, strict=True):
            pygame.draw.circle(layer, color, center, radius)
        self._fine.blit(layer, around)

    def ring(self, center: ArrayLike, radius: float, color: Color, width: float = 1.0) -> None:
        """Draw the outline of a circle."""
        thickness = max(1, round(_FINE * width))
        pygame.draw.circle(self._fine, color, _plain(center), _FINE * radius, thickness)

    def text(
        self, text: str, at: Sequence[float], color: Color, anchor: Anchor = "topleft", height: float = TYPE
    ) -> int:
        """Write text on top of everything, with its ``anchor`` at a point, and return its width."""
        written = _written(text, round(height * self.size), color)
        self._texts.append((written, written.get_rect(**{anchor: at})))
        return written.get_width()

    def image(self) -> Image:
        """Return the picture, shape (size, size, 3). Nothing can be drawn afterwards."""
        surface = pygame.transform.smoothscale(self._fine, (self.size, self.size))
        _SPARE[self.size] = self._fine
        surface.blits(self._texts, doreturn=False)
        flat = np.frombuffer(pygame.image.tobytes(surface, "RGB"), np.uint8)
        return flat.reshape(self.size, self.size, 3).copy()


@lru_cache(maxsize=512)
def _written(text: str, size: int, color: Color) -> pygame.Surface:
    try:
        return _font(size).render(text, True, color)
    except pygame.error:  # a `pygame.quit` by other code invalidates fonts
        _font.cache_clear()
        return _font(size).render(text, True, color)


@lru_cache(maxsize=32)
def _font(size: int) -> pygame.font.Font:
    pygame.font.init()
    return pygame.font.Font(None, size)  # pygame's own font


def _plain(points: ArrayLike) -> Any:
    return (_FINE * np.asarray(points)).tolist()
