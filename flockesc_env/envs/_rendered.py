"""What environments with one picture have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flockesc_env.render import render

if TYPE_CHECKING:
    from flockesc_env.render.viewer import Viewer


class Rendered:
    """Shows what a viewer sees, if there is one."""

    _viewer: Viewer | None

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, shape (size, size, 3), or show it in mode ``"human"``.

        Raises:
            EpisodeError: before ``reset``.
        """
        pictures = render(self._viewer)
        return pictures[0] if pictures else None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._viewer is not None:
            self._viewer.close()
