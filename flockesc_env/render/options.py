"""Options of pictures, and the check of the ``video`` extra."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Final, Literal, cast, get_args

import numpy as np

from flockesc_env.common.checks import as_array, as_choice, as_count, as_floats
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.extras import require
from flockesc_env.models.simulate import IntArray

RenderMode = Literal["human", "rgb_array"]
Show = Literal["none", "discs", "edges"]
ColorBy = Literal["component", "range"]

RENDER_MODES: Final = get_args(RenderMode)


@dataclass(frozen=True, kw_only=True)
class RenderOptions:
    """Options of pictures. Pictures of a line use ``size`` only.

    Attributes:
        size: width and height in pixels, an even number from 160 to 16384.
        show: ``"edges"`` draws the edges of the neighbor graph, ``"discs"`` the interaction ranges as discs,
            or edges if a range is a number of neighbors; ``"none"`` draws neither.
        agents: indices of the agents whose discs or edges are drawn; ``None`` means all.
        trail: length of a predator's trail in s.
        color: what the color of an agent shows: its ``"component"`` or its interaction ``"range"``.
        largest_range: end of the color scale of ranges; ``None``: the largest range of the picture or, in a
            video, of all runs.

    Raises:
        InputError: if an option has a wrong type or is out of bounds; it names the option.
    """

    size: int = 512
    show: Show = "none"
    agents: tuple[int, ...] | None = None
    trail: float = 3.0
    color: ColorBy = "component"
    largest_range: float | None = None

    def __post_init__(self) -> None:
        size = as_count(self.size, "size", least=160, most=16_384)
        if size % 2:
            raise InputError("size", "an even number", size)
        as_choice(self.show, "show", get_args(Show))
        if self.agents is not None:
            agents = as_array(self.agents, "agents")
            if agents.ndim != 1 or not agents.size or agents.dtype.kind not in "iu" or agents.min() < 0:
                raise InputError("agents", "indices of agents", shown(self.agents))
            object.__setattr__(self, "agents", tuple(agents.tolist()))
        as_choice(self.color, "color", get_args(ColorBy))
        if self.largest_range is not None:
            largest = float(as_floats(self.largest_range, "largest_range", (), least=0.0))
            object.__setattr__(self, "largest_range", largest)
        trail = float(as_floats(self.trail, "trail", (), least=0.0))
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "trail", trail)

    def selected(self, num_agents: int) -> IntArray:
        """Return the indices of the agents to draw; raise ``InputError`` if one is out of bounds."""
        if self.agents is None:
            return np.arange(num_agents)
        if max(self.agents) >= num_agents:
            raise InputError("agents", f"indices below {num_agents}", max(self.agents))
        return np.array(self.agents)


def as_mode_and_options(mode: Any, options: Any) -> tuple[RenderMode | None, RenderOptions]:
    """Return a render mode, or ``None``, and render options; anything else raises ``InputError``."""
    if mode is not None and (not isinstance(mode, str) or mode not in RENDER_MODES):
        raise InputError("render_mode", f"one of {', '.join(RENDER_MODES)} or None", shown(mode))
    return cast("RenderMode | None", mode), as_render_options(options)


def as_render_options(value: Any) -> RenderOptions:
    """Return render options, the defaults for ``None``; anything else raises ``InputError``."""
    if value is None:
        return RenderOptions()
    if not isinstance(value, RenderOptions):
        raise InputError("render_options", "RenderOptions or None", shown(value))
    return value


def require_video(*modules: str) -> None:
    """Require modules of the ``video`` extra, and set up the environment of pygame."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a greeting on stdout
    os.environ.setdefault("SDL_NO_SIGNAL_HANDLERS", "1")  # SDL would catch SIGTERM, also in forked workers
    require("video", modules)
