"""Check of the ``video`` extra, and settings of pygame that must precede its import."""

from __future__ import annotations

import os

from flockesc_env.common.extras import require


def require_video(*modules: str) -> None:
    """Check that modules of the ``video`` extra are installed, and set up the environment of pygame.

    Raises:
        MissingExtraError: if a module is not installed.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a greeting on stdout
    os.environ.setdefault("SDL_NO_SIGNAL_HANDLERS", "1")  # SDL would catch SIGTERM, also in forked workers
    require("video", modules)
