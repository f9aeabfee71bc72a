"""Drawing with pygame, without a display, and the window. Only this file imports pygame."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.common.extras import require
from flockesc_env.render.palette import LIGHT, Color, rgb

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a greeting on stdout
os.environ.setdefault("SDL_NO_SIGNAL_HANDLERS", "1")  # SDL would catch SIGTERM, also in forked workers
require("video", ["pygame"])
import pygame  # noqa: E402, after the check

Image = NDArray[np.uint8]
Anchor = Literal["topleft", "midtop", "topright", "midleft", "midright", "midbottom", "center"]

TYPE = 0.055
"""Height of text, over the width of a picture."""

_PAPER = rgb(LIGHT.ground)
_FINE = 2
"""Oversampling per axis: each pixel is the mean of this many drawn ones, squared, which smooths edges."""

_CLOCK = pygame.time.Clock()


class Canvas:
    """A square picture of ``size`` px. Points and lengths are in px and can be fractions; y points down.

    ``colors`` have a row (red, green, blue) per polygon, line or circle.
    """

    def __init__(self, size: int) -> None:
        pygame.font.init()
        self.size = size
        self._fonts: dict[float, pygame.font.Font] = {}
        self._surface = pygame.Surface((_FINE * size, _FINE * size))
        self._surface.fill(_PAPER)

    def polygons(self, points: FloatArray, colors: ArrayLike) -> None:
        """Fill polygons, shape (k, corners, 2), with a rim in the color of the paper."""
        for corners, color in zip(_fine(points), np.asarray(colors).tolist(), strict=True):
            pygame.draw.polygon(self._surface, color, corners)
            pygame.draw.polygon(self._surface, _PAPER, corners, 1)

    def segments(self, points: FloatArray, colors: ArrayLike, width: float = 1.0) -> None:
        """Draw straight lines, shape (k, 2, 2)."""
        for (start, end), color in zip(_fine(points), np.asarray(colors).tolist(), strict=True):
            pygame.draw.line(self._surface, color, start, end, max(1, round(_FINE * width)))

    def discs(self, centers: FloatArray, radii: ArrayLike, colors: ArrayLike, rim: float = 0.0) -> None:
        """Fill circles, shapes (k, 2) and (k,); a ``rim`` above 0 draws only a rim of this width."""
        reach = np.broadcast_to(np.minimum(radii, 3 * self.size), len(centers))  # covers the picture
        circles = zip(_fine(centers), _fine(reach), np.asarray(colors).tolist(), strict=True)
        for center, radius, color in circles:
            pygame.draw.circle(self._surface, color, center, radius, round(_FINE * rim))

    def text(
        self, text: str, at: Sequence[float], color: Color, anchor: Anchor = "topleft", height: float = TYPE
    ) -> float:
        """Write text with its ``anchor`` at a point, and return its width."""
        if height not in self._fonts:  # pygame's own font, not kept longer: `pygame.quit` invalidates it
            self._fonts[height] = pygame.font.Font(None, round(_FINE * height * self.size))
        written = self._fonts[height].render(text, True, color)
        self._surface.blit(written, written.get_rect(**{anchor: _fine(at)}))
        return written.get_width() / _FINE

    def image(self) -> Image:
        """Return the picture, shape (size, size, 3)."""
        surface = pygame.transform.smoothscale(self._surface, (self.size, self.size))
        flat = np.frombuffer(pygame.image.tobytes(surface, "RGB"), np.uint8)
        return flat.reshape(self.size, self.size, 3).copy()


def show(image: Image, fps: int) -> None:
    """Show a picture in the window of this process, at most ``fps`` per second; the first one opens it."""
    height, width, _ = image.shape
    screen = pygame.display.get_surface()
    if screen is None or screen.get_size() != (width, height):
        pygame.display.init()
        screen = pygame.display.set_mode((width, height))
        pygame.display.set_caption("flockesc_env")
    screen.blit(pygame.image.frombuffer(image.tobytes(), (width, height), "RGB"), (0, 0))
    pygame.event.pump()
    _CLOCK.tick(fps)
    pygame.display.flip()


def close_window() -> None:
    """Close the window, if there is one."""
    pygame.display.quit()


def _fine(points: ArrayLike) -> Any:
    return (_FINE * np.asarray(points)).tolist()
