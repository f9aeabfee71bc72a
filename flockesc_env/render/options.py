"""What a picture shows and how large it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np

from flockesc_env._checks import as_array, as_count, as_floats
from flockesc_env.errors import ScenarioError
from flockesc_env.simulate import IntArray

RenderMode = Literal["human", "rgb_array"]
Show = Literal["none", "discs", "edges"]

RENDER_MODES: Final = get_args(RenderMode)

_MIN_SIZE = 160


@dataclass(frozen=True, kw_only=True)
class RenderOptions:
    """Options of the pictures; of a line, ``size`` alone matters.

    Attributes:
        size: width and height in pixels, an even number of at least 160.
        show: ``"edges"``: the edges of the neighbor graph, from whoever listens to whoever is heard;
            ``"discs"``: the interaction range of agents as a disc, or edges where it is no length.
        agents: indices of the agents whose discs or edges are drawn; ``None``: all.
        trail: length of a predator's trail in s.

    Raises:
        ScenarioError: naming an option of a wrong type or out of bounds.
    """

    size: int = 512
    show: Show = "none"
    agents: tuple[int, ...] | None = None
    trail: float = 3.0

    def __post_init__(self) -> None:
        size = as_count(self.size, "size", ScenarioError)
        if size < _MIN_SIZE or size % 2:
            raise ScenarioError("size", f"an even number of at least {_MIN_SIZE}", size)
        if self.show not in get_args(Show):
            raise ScenarioError("show", f"one of {', '.join(get_args(Show))}", repr(self.show))
        if self.agents is not None:
            agents = as_array(self.agents, "agents", ScenarioError)
            if agents.ndim != 1 or not agents.size or agents.dtype.kind not in "iu" or agents.min() < 0:
                raise ScenarioError("agents", "indices of agents", repr(self.agents))
            object.__setattr__(self, "agents", tuple(agents.tolist()))
        trail = float(as_floats(self.trail, "trail", (), ScenarioError))
        if trail < 0:
            raise ScenarioError("trail", "a number of at least 0", trail)
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "trail", trail)

    def selected(self, num_agents: int) -> IntArray:
        """Return the indices of the agents whose discs or edges are drawn.

        Raises:
            ScenarioError: if one of them is no agent of a flock of that size.
        """
        if self.agents is None:
            return np.arange(num_agents)
        if max(self.agents) >= num_agents:
            raise ScenarioError("agents", f"indices below {num_agents}", max(self.agents))
        return np.array(self.agents)


def as_render_mode(value: Any) -> RenderMode | None:
    """Return a render mode, or ``None``.

    Raises:
        ScenarioError: for anything else.
    """
    if value is not None and value not in RENDER_MODES:
        raise ScenarioError("render_mode", f"one of {', '.join(RENDER_MODES)} or None", repr(value))
    mode: RenderMode | None = value
    return mode


def as_render_options(value: Any) -> RenderOptions:
    """Return options, the defaults for ``None``.

    Raises:
        ScenarioError: for anything else.
    """
    if value is None:
        return RenderOptions()
    if not isinstance(value, RenderOptions):
        raise ScenarioError("render_options", "RenderOptions or None", repr(value))
    return value
