"""Imports of the ``video`` extra."""

from __future__ import annotations

import os
from importlib import import_module

from gymnasium.error import DependencyNotInstalled


def require(*modules: str) -> None:
    """Import modules of the ``video`` extra.

    Raises:
        DependencyNotInstalled: if one of them is missing.
    """
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame greets on standard output
    os.environ.setdefault("SDL_NO_SIGNAL_HANDLERS", "1")  # SDL would catch SIGTERM, also in forked workers
    for module in modules:
        try:
            import_module(module)
        except ImportError as error:
            raise DependencyNotInstalled(
                f'{module} is not installed, run `pip install "flockesc-env[video]"`'
            ) from error
