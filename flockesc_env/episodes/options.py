"""Options that all environments share: what an action means, what is paid, what is seen."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from typing import Any, Literal, Self, get_args

import numpy as np

from flockesc_env.common.checks import as_choice, as_count, as_flag, as_floats
from flockesc_env.common.errors import ScenarioError, shown

ActionMode = Literal["normalized", "range", "discrete"]
Objective = Literal["mean", "minimum", "survival"]
TeamReward = Literal["running_minimum", "distance", "terminal"]
OwnReward = Literal[
    "own_distance",
    "own_distance_change",
    "own_running_minimum",
    "neighborhood_distance_change",
    "difference",
]
Reward = Literal[TeamReward, OwnReward]
LineReward = Literal["difference", "terminal"]

_LARGEST_ACTION = float(np.finfo(np.float32).max)

GRID_SIZE = 21
"""Number of ranges in the default grid of ``action_mode="discrete"``."""


@dataclass(frozen=True, kw_only=True)
class ActionOptions:
    """How an action sets the interaction range.

    Attributes:
        action_mode: ``"normalized"``: Box [-1, 1] mapped linearly onto [``min_range``, ``max_range``];
            ``"range"``: Box [``min_range``, ``max_range``], the range itself;
            ``"discrete"``: the index of an entry of ``range_grid``.
        min_range: smallest range, at least 0 (m in the flock).
        max_range: largest range, above ``min_range``.
        range_grid: ranges of ``"discrete"``; default: 21 equally spaced ones from ``min_range`` to
            ``max_range``.
        steps_per_action: steps of the model during which one action holds; the last action of an episode
            holds for what is left.
    """

    action_mode: ActionMode = "normalized"
    min_range: float = 0.0
    max_range: float = 100.0
    range_grid: tuple[float, ...] | None = None
    steps_per_action: int = 1

    def __post_init__(self) -> None:
        as_choice(self.action_mode, "action_mode", get_args(ActionMode), ScenarioError)
        low = float(as_floats(self.min_range, "min_range", (), ScenarioError, least=0.0))
        high = float(as_floats(self.max_range, "max_range", (), ScenarioError))
        if high <= low:
            raise ScenarioError("max_range", f"a number above min_range = {low}", high)
        if self.action_mode == "range" and high > _LARGEST_ACTION:
            raise ScenarioError("max_range", f"at most {_LARGEST_ACTION}, as actions are float32", high)
        steps = as_count(self.steps_per_action, "steps_per_action", ScenarioError)
        object.__setattr__(self, "steps_per_action", steps)
        object.__setattr__(self, "min_range", low)
        object.__setattr__(self, "max_range", high)
        if self.range_grid is not None:
            grid = as_floats(self.range_grid, "range_grid", error=ScenarioError)
            if grid.ndim != 1 or not grid.size or grid.min() < low or grid.max() > high:
                raise ScenarioError("range_grid", f"ranges from {low} to {high}", shown(self.range_grid))
            object.__setattr__(self, "range_grid", tuple(grid.tolist()))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some options changed, checked anew."""
        return dataclasses.replace(self, **changes)


@dataclass(frozen=True, kw_only=True)
class EnvOptions(ActionOptions):
    """Options of the flock environments.

    Attributes:
        objective: ``"mean"``: keep the mean predator distance large (Eq. 12); ``"minimum"``: the minimum
            predator distance (Eq. 13); ``"survival"``: the share of agents that are not caught.
        reward: ``"running_minimum"``: r_t = m_t - m_(t-1), m the objective's running minimum, so that the
            return is exactly the objective minus its start; ``"distance"``: the objective's value over the
            number of steps; ``"terminal"``: the objective minus its start, at the end. With one range
            per agent also ``"own_distance"``: as ``"distance"``, each agent its own;
            ``"own_distance_change"``: d_i(t) - d_i(t-1), which tells an agent at once what it gained;
            ``"own_running_minimum"``: each agent's part of ``"running_minimum"`` of the mean distance;
            ``"neighborhood_distance_change"``: the mean of that over the agents within ``max_range``, itself
            included; and ``"difference"``: what the objective's value after an action of several steps gains
            by what the agent hears during it, at the cost of one more such action per agent.
        predator_sensing_range: distance in m up to which observations show a predator;
            ``"predator_range"``: the scenario's predator range; ``None``: any distance.
        count_components: whether ``info`` holds ``num_components``, which takes a search of the neighbor
            graph after every action.
    """

    objective: Objective = "mean"
    reward: Reward = "running_minimum"
    predator_sensing_range: float | Literal["predator_range"] | None = "predator_range"
    count_components: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        as_choice(self.objective, "objective", get_args(Objective), ScenarioError)
        as_choice(self.reward, "reward", get_args(Reward), ScenarioError)
        sensing = self.predator_sensing_range
        if sensing is not None and not (isinstance(sensing, str) and sensing == "predator_range"):
            sensing = float(as_floats(sensing, "predator_sensing_range", (), ScenarioError, least=0.0))
            object.__setattr__(self, "predator_sensing_range", sensing)
        counts = as_flag(self.count_components, "count_components", ScenarioError)
        object.__setattr__(self, "count_components", counts)

    @property
    def is_own(self) -> bool:
        """Whether the reward pays every agent its own."""
        return self.reward in get_args(OwnReward)

    def to_core(self, *, per_agent: bool) -> str:
        """Return the JSON document that the core takes."""
        return json.dumps(
            {
                "view": "agent" if per_agent else "flock",
                "objective": self.objective,
                "reward": self.reward,
                "max_range": self.max_range,
                "predator_sensing_range": self.predator_sensing_range,
                "steps_per_action": self.steps_per_action,
            }
        )


@dataclass(frozen=True, kw_only=True)
class LineOptions(ActionOptions):
    """Options of the line environment; ``max_range`` is 1, the length of the initial interval.

    Attributes:
        reward: ``"difference"``: d(t) - d(t-1), so that the return is exactly d_ss - d(0);
            ``"terminal"``: the same sum, at the end.
    """

    max_range: float = 1.0
    reward: LineReward = "difference"

    def __post_init__(self) -> None:
        super().__post_init__()
        as_choice(self.reward, "reward", get_args(LineReward), ScenarioError)

    def to_core(self) -> str:
        """Return the JSON document that the core takes."""
        return json.dumps(
            {"reward": self.reward, "max_range": self.max_range, "steps_per_action": self.steps_per_action}
        )
