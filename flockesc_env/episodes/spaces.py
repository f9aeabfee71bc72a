"""From actions to ranges and back, and what the entries of an observation are called."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_array
from flockesc_env.common.errors import ActionError, ArgumentError
from flockesc_env.episodes.options import GRID_SIZE, ActionOptions

Label = Callable[[int], str]
"""What the error calls an action, given its place in the stack."""

STACKED: Label = "action[{}]".format


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
        self._shape: tuple[int, ...] = (1,) if self.grid is None else ()
        self._bounds = (-1.0, 1.0) if self.mode == "normalized" else (self.min_range, self.max_range)
        grid = None if self.grid is None else self.grid.tolist()
        self.core = _core.RangeMap(self.min_range, self.max_range, self.mode == "normalized", grid)

    def space(self) -> gymnasium.Space[Any]:
        """Return a new action space for one range: Box of shape (1,), or Discrete."""
        if self.grid is not None:
            return spaces.Discrete(len(self.grid))
        low, high = self._bounds
        return spaces.Box(low, high, (1,), np.float32)

    def one(self, action: Any, label: str) -> NDArray[Any]:
        """Return a single action as an array of the space's shape, its value not yet judged.

        Raises:
            ActionError: naming ``label``, for a wrong dtype or shape.
        """
        return self._array(action, self._shape, label)

    def to_range(self, action: Any) -> float:
        """Map a single action to its range.

        Raises:
            ActionError: naming ``action``, for a wrong dtype or shape, or if it is outside of the space.
        """
        rho = self.core.to_range(action)
        return rho if rho is not None else float(self.to_ranges(*self._alone(action))[0])

    def to_ranges(self, actions: Any, count: int, label: Label = STACKED) -> FloatArray:
        """Map ``count`` actions, stacked to shape (count, 1) or, where discrete, (count,), to as many ranges.

        Raises:
            ActionError: for a wrong dtype or shape, or an action outside of the space, named by ``label``.
        """
        return self._judge(actions, count, label)[1]

    def plain(
        self, actions: Any, count: int, label: Label = STACKED, ignored: NDArray[np.bool] | None = None
    ) -> NDArray[Any]:
        """Return ``count`` stacked actions in the form that the core takes.

        Args:
            actions: shape (count, 1) or, where discrete, (count,), of any real or integer type.
            count: number of actions.
            label: names an action in an error.
            ignored: actions whose values do not matter, shape (count,).

        Raises:
            ActionError: as ``to_ranges``.
        """
        return self._judge(actions, count, label, ignored)[0]

    def plain_one(self, action: Any) -> Any:
        """Return a single action in the form that the core takes.

        Raises:
            ActionError: as ``to_range``.
        """
        return self.plain(*self._alone(action))[0]

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

    def _array(self, actions: Any, shape: tuple[int, ...], label: str) -> NDArray[Any]:
        array = as_array(actions, label, ActionError)
        kinds, expected = ("iu", "integers") if self.grid is not None else ("fiu", "real numbers")
        if array.dtype.kind not in kinds:
            raise ActionError(label, expected, f"dtype {array.dtype}")
        if array.shape != shape:
            raise ActionError(label, f"shape {shape}", f"shape {array.shape}")
        return array

    def _alone(self, action: Any) -> tuple[NDArray[Any], int, Label]:
        """Return a single action as a stack of one, with its number and label."""
        return self.one(action, "action")[np.newaxis], 1, lambda _: "action"

    def _judge(
        self, actions: Any, count: int, label: Label, ignored: NDArray[np.bool] | None = None
    ) -> tuple[NDArray[Any], FloatArray]:
        """Return actions as float64 or int64, in new memory without gaps, and their ranges."""
        array = self._array(actions, (count, *self._shape), "action")
        with np.errstate(over="ignore"):  # what is too large for a float64 is infinite, and out of bounds
            plain = np.array(array, np.float64 if self.grid is None else np.int64, order="C")
        ranges = self.core.to_ranges(plain)
        refused = np.isnan(ranges)
        if ignored is not None:
            refused &= ~ignored
        if refused.any():
            first = int(np.argmax(refused))
            if self.grid is None:
                low, high = self._bounds
                raise ActionError(label(first), f"a number from {low} to {high}", plain[first].item())
            expected = f"an integer from 0 to {len(self.grid) - 1}"
            raise ActionError(label(first), expected, array[first].item())
        return plain, ranges


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
    """What a policy needs to know of the environment that it steers.

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
