"""Rendering of environments, and grids of pictures."""

import sys
from collections.abc import Sequence
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_choice
from flockesc_env.common.errors import ResetNeededError
from flockesc_env.render.frames import FlockFrame, LineFrame, as_size

Image = NDArray[np.uint8]
RenderMode = Literal["human", "rgb_array"]

RENDER_MODES: Final = get_args(RenderMode)


class Viewer:
    """Pictures of an environment, as arrays or, in mode ``"human"``, in a window.

    ``frames`` has an entry per flock, or one for a line: its state after the last reset or step, or ``None``.
    """

    def __init__(self, mode: RenderMode, size: int, fps: int, count: int) -> None:
        self._mode, self._size, self._fps = mode, size, fps
        self.frames: list[Any] = [None] * count

    def update(self, frames: Sequence[FlockFrame | LineFrame]) -> None:
        """Take the frames after a reset or a step, and show them in mode ``"human"``."""
        self.frames = list(frames)
        if self._mode == "human":
            self.render()

    def images(self) -> list[Image]:
        """Return a picture of every flock, or of the line; raise ``ResetNeededError`` before a reset."""
        if any(frame is None for frame in self.frames):
            raise ResetNeededError("render() called before reset()")
        from flockesc_env.render.picture import draw_frame  # loads pygame, an extra

        return [draw_frame(frame, self._size) for frame in self.frames]

    def render(self) -> list[Image] | None:
        """Return ``images`` or, in mode ``"human"``, show them."""
        images = self.images()
        if self._mode == "rgb_array":
            return images
        from flockesc_env.render.picture import show  # loads pygame, an extra

        show(tiled(images), self._fps)
        return None

    def close(self) -> None:
        """Close the window, if there is one; the next picture opens it again."""
        picture = sys.modules.get("flockesc_env.render.picture")  # missing: nothing was drawn
        if self._mode == "human" and picture is not None:
            picture.close_window()


def as_viewer(mode: Any, size: Any, fps: int, count: int = 1) -> Viewer | None:
    """Return the viewer of ``count`` flocks, or of a line; ``None`` without a mode.

    An invalid mode or size raises ``InputError``.
    """
    size = as_size(size, "render_size")
    return None if mode is None else Viewer(as_choice(mode, "render_mode", RENDER_MODES), size, fps, count)


def grid_shape(count: int) -> tuple[int, int]:
    """Return the columns and rows of a grid of pictures, about as many rows as columns."""
    columns = int(np.ceil(np.sqrt(count)))
    return columns, -(-count // columns)


def tiled(images: list[Image]) -> Image:
    """Arrange pictures of one size in a grid."""
    columns, rows = grid_shape(len(images))
    blank = np.full_like(images[0], 255)
    filled = [*images, *[blank] * (rows * columns - len(images))]
    return np.vstack([np.hstack(filled[row * columns : (row + 1) * columns]) for row in range(rows)])
