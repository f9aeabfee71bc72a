"""The window of ``render_mode="human"``."""

from __future__ import annotations

from typing import Self

import pygame

from flockesc_env.render.canvas import Image


class Window:
    """Shows pictures at a steady rate. All windows of a process share one, which shows the last picture.

    Args:
        fps: largest number of pictures per second.
    """

    def __init__(self, fps: int) -> None:
        self._fps = fps
        self._clock = pygame.time.Clock()

    def show(self, image: Image) -> None:
        """Show a picture. The first one opens the window."""
        height, width, _ = image.shape
        screen = pygame.display.get_surface()
        if screen is None or screen.get_size() != (width, height):
            pygame.display.init()
            screen = pygame.display.set_mode((width, height))
            pygame.display.set_caption("flockesc_env")
        screen.blit(pygame.image.frombuffer(image.tobytes(), (width, height), "RGB"), (0, 0))
        pygame.event.pump()
        self._clock.tick(self._fps)
        pygame.display.flip()

    def close(self) -> None:
        """Close the window. The next picture opens it again."""
        pygame.display.quit()

    def __reduce__(self) -> tuple[type[Self], tuple[int]]:
        return type(self), (self._fps,)  # a copy has its own clock
