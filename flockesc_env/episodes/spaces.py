"""Action spaces, maps between actions and ranges, and names and bounds of observation entries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray
from flockesc_env.common.errors import ArgumentError
from flockesc_env.episodes.options import GRID_SIZE, ActionOptions

Label = Callable[[int], str]
"""Names an action in an error, given its index in the stack."""


class RangeActions:
    """The action space of one range, and the two maps between its actions and ranges.

    Attributes:
        grid: ranges of the discrete mode, shape (size,); ``None`` in the other modes.
        core: the map from actions to ranges.
    """

    def __init__(self, options: ActionOptions) -> None:
        self.mode = options.action_mode
        self.min_range = options.min_range
        self.max_range = options.max_range
        self.grid: FloatArray | None = None
        if self.mode == "discrete":
            default = np.linspace(self.min_range, self.max_range, GRID_SIZE)
            self.grid = default if options.range_grid is None else np.array(options.range_grid)
            self.grid.flags.writeable = False
        grid = None if self.grid is None else self.grid.tolist()
        self.core = _core.RangeMap(self.min_range, self.max_range, self.mode == "normalized", grid)

    def space(self) -> gymnasium.Space[Any]:
        """Return a new action space for one range: Box of shape (1,), or Discrete."""
        if self.grid is not None:
            return spaces.Discrete(len(self.grid))
        low, high = (-1.0, 1.0) if self.mode == "normalized" else (self.min_range, self.max_range)
        return spaces.Box(low, high, (1,), np.float32)

    def to_range(self, action: Any) -> float:
        """Map a single action to its range.

        Raises:
            ActionError: naming ``action``, for a wrong dtype or shape, or if it is outside of the space.
        """
        return self.core.to_range(action)

    def to_ranges(self, actions: Any, count: int, label: Label | None = None) -> FloatArray:
        """Map ``count`` actions, stacked to shape (count, 1) or, where discrete, (count,), to as many ranges.

        Args:
            actions: stacked actions of any real or, where discrete, integer type.
            count: number of actions.
            label: names an action in an error; ``None``: ``action[i]``.

        Raises:
            ActionError: for a wrong dtype or shape, or an action outside of the space.
        """
        return self.core.to_ranges(actions, count, label)

    def from_ranges(self, ranges: FloatArray) -> NDArray[Any]:
        """Map ranges of shape (k,) to actions: (k, 1) float32, or the nearest grid indices (k,) int64.

        Raises:
            ArgumentError: for a range outside of [``min_range``, ``max_range``].
        """
        outside = ~((ranges >= self.min_range) & (ranges <= self.max_range))
        if outside.any():
            bounds = f"a number from {self.min_range} to {self.max_range}"
            raise ArgumentError("interaction_range", bounds, ranges[outside][0])
        if self.grid is not None:
            indices: NDArray[np.int64] = np.abs(ranges[:, None] - self.grid).argmin(axis=1)
            return indices
        if self.mode == "normalized":
            ranges = 2 * (ranges - self.min_range) / (self.max_range - self.min_range) - 1
        return ranges[:, None].astype(np.float32)


@dataclass(frozen=True)
class ObservationLayout:
    """Names and bounds of the entries of an observation row (docs/model.md, "Observations")."""

    names: tuple[str, ...]
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    @classmethod
    def of(cls, entries: list[tuple[str, float, float]]) -> ObservationLayout:
        """Build a layout from the core's list of (name, low, high)."""
        names, low, high = zip(*entries, strict=True)
        layout = cls(names, np.array(low, np.float32), np.array(high, np.float32))
        layout.low.flags.writeable = layout.high.flags.writeable = False
        return layout

    def space(self) -> gymnasium.Space[NDArray[np.float32]]:
        """Return a new observation space."""
        return spaces.Box(self.low, self.high, dtype=np.float32)

    def index(self, name: str) -> int:
        """Return the column of an entry.

        Raises:
            ArgumentError: if this layout has no entry of that name.
        """
        if name not in self.names:
            raise ArgumentError("observation", f"an entry {name!r}", f"only {', '.join(self.names)}")
        return self.names.index(name)


def predator_layout(dimension: int) -> ObservationLayout:
    """Return the layout of a learned predator's observation row."""
    return ObservationLayout.of(_core.predator_observation_entries(dimension))


@dataclass(frozen=True)
class PolicySpec:
    """Shapes and meaning of the observations and actions of a policy.

    Attributes:
        actions: from ranges to actions and back.
        layout: the entries of an observation row.
        per_agent: whether there is one row and one action per agent, or one per flock.
        num_agents: agents per flock; rows come flock after flock.
        num_steps: steps of an episode.
    """

    actions: RangeActions
    layout: ObservationLayout
    per_agent: bool
    num_agents: int
    num_steps: int
