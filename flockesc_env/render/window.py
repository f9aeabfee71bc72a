"""The window of ``render_mode="human"``."""

from __future__ import annotations

from typing import Self

import pygame

from flockesc_env.render.canvas import Image


class Window:
    """Shows pictures at a steady rate. A process has one window, which the last picture shown owns.

    Args:
        fps: pictures per second at most.
    """

    def __init__(self, fps: int) -> None:
        self._fps = fps
        self._clock = pygame.time.Clock()

    def show(self, image: Image) -> None:
        """Show a picture; the window opens with the first."""
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
        """Close the window; the next picture opens another."""
        pygame.display.quit()

    def __reduce__(self) -> tuple[type[Self], tuple[int]]:
        return type(self), (self._fps,)  # a copy has a clock of its own
