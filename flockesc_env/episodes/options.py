"""Options of the environments: what an action sets, what is rewarded, what is observed."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Literal, Self, TypedDict, get_args

import numpy as np

from flockesc_env.common.checks import as_choice, as_count, as_flag, as_floats
from flockesc_env.common.errors import OptionError, shown
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.neighbors import Topological

ActionMode = Literal["normalized", "range", "discrete"]
Objective = Literal["mean", "minimum", "survival"]
TeamReward = Literal["running_minimum", "distance", "terminal"]
IndividualReward = Literal[
    "individual_distance",
    "individual_distance_change",
    "individual_running_minimum",
    "neighborhood_distance_change",
    "difference",
]
Reward = Literal[TeamReward, IndividualReward]
LineReward = Literal["change", "terminal"]
SensingRange = float | Literal["predator_range"] | None

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
        max_range: largest range, above ``min_range``. Under a topological rule ranges are numbers of
            neighbors, and ``max_range`` must be given.
        range_grid: ranges of ``"discrete"``; default: 21 equally spaced ones from ``min_range`` to
            ``max_range``.
        steps_per_action: steps of the model during which one action holds; the last action of an episode
            holds for the steps that remain.
    """

    action_mode: ActionMode = "normalized"
    min_range: float = 0.0
    max_range: float = 100.0
    range_grid: Sequence[float] | None = None
    steps_per_action: int = 1

    def __post_init__(self) -> None:
        as_choice(self.action_mode, "action_mode", get_args(ActionMode), OptionError)
        low = float(as_floats(self.min_range, "min_range", (), OptionError, least=0.0))
        high = float(as_floats(self.max_range, "max_range", (), OptionError))
        if high <= low:
            raise OptionError("max_range", f"a number above min_range = {low}", high)
        if self.action_mode == "range" and high > _LARGEST_ACTION:
            raise OptionError("max_range", f"at most {_LARGEST_ACTION}, as actions are float32", high)
        steps = as_count(self.steps_per_action, "steps_per_action", OptionError)
        object.__setattr__(self, "steps_per_action", steps)
        object.__setattr__(self, "min_range", low)
        object.__setattr__(self, "max_range", high)
        if self.range_grid is not None:
            grid = as_floats(self.range_grid, "range_grid", error=OptionError)
            if grid.ndim != 1 or not grid.size or grid.min() < low or grid.max() > high:
                raise OptionError("range_grid", f"ranges from {low} to {high}", shown(self.range_grid))
            object.__setattr__(self, "range_grid", tuple(grid.tolist()))

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some options changed and checked."""
        return dataclasses.replace(self, **changes)


@dataclass(frozen=True, kw_only=True)
class EnvOptions(ActionOptions):
    """Options of the flock environments.

    Attributes:
        objective: ``"mean"``: keep the mean predator distance large (Eq. 12); ``"minimum"``: the minimum
            predator distance (Eq. 13); ``"survival"``: the share of agents that are not caught.
        reward: ``"running_minimum"``: r_t = m_t - m_(t-1), m the objective's running minimum, so that the
            return is exactly the objective minus its start; ``"distance"``: the objective's value over the
            number of steps; ``"terminal"``: the objective minus its start, at the end. With one range per
            agent also the individual rewards: ``"individual_distance"``: as ``"distance"``, from the agent's
            own distance; ``"individual_distance_change"``: d_i(t) - d_i(t-1);
            ``"individual_running_minimum"``: the agent's part of ``"running_minimum"`` of the mean distance;
            ``"neighborhood_distance_change"``: the mean of d_j(t) - d_j(t-1) over the agents j within
            ``max_range``, itself included; and ``"difference"`` (Wolpert and Tumer): the objective's value
            after an action, minus its value had this agent listened to nobody. It repeats the action once per
            agent.
        predator_sensing_range: distance in m up to which observations show a predator;
            ``"predator_range"``: the scenario's predator range; ``None``: any distance.
        count_components: whether ``info`` holds ``num_components``, which takes a search of the neighbor
            graph after every action.
    """

    objective: Objective = "mean"
    reward: Reward = "running_minimum"
    predator_sensing_range: SensingRange = "predator_range"
    count_components: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        as_choice(self.objective, "objective", get_args(Objective), OptionError)
        as_choice(self.reward, "reward", get_args(Reward), OptionError)
        sensing = self.predator_sensing_range
        if sensing is not None and not (isinstance(sensing, str) and sensing == "predator_range"):
            sensing = float(as_floats(sensing, "predator_sensing_range", (), OptionError, least=0.0))
            object.__setattr__(self, "predator_sensing_range", sensing)
        counts = as_flag(self.count_components, "count_components", OptionError)
        object.__setattr__(self, "count_components", counts)

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
        reward: ``"change"``: d(t) - d(t-1), so that the return is exactly d_ss - d(0);
            ``"terminal"``: the same sum, at the end.
    """

    max_range: float = 1.0
    reward: LineReward = "change"

    def __post_init__(self) -> None:
        super().__post_init__()
        as_choice(self.reward, "reward", get_args(LineReward), OptionError)

    def to_core(self) -> str:
        """Return the JSON document that the core takes."""
        return json.dumps(
            {"reward": self.reward, "max_range": self.max_range, "steps_per_action": self.steps_per_action}
        )


class ActionOptionsDict(TypedDict, total=False):
    """``ActionOptions`` as keyword arguments."""

    action_mode: ActionMode
    min_range: float
    max_range: float
    range_grid: Sequence[float] | None
    steps_per_action: int


class EnvOptionsDict(ActionOptionsDict, total=False):
    """``EnvOptions`` as keyword arguments."""

    objective: Objective
    reward: Reward
    predator_sensing_range: SensingRange
    count_components: bool


class LineOptionsDict(ActionOptionsDict, total=False):
    """``LineOptions`` as keyword arguments."""

    reward: LineReward


def env_options(scenario: FlockScenario, options: EnvOptionsDict) -> EnvOptions:
    """Return the options of an environment with this scenario.

    Raises:
        OptionError: naming an option that is unknown, missing or out of bounds.
    """
    check_names(options, EnvOptionsDict.__annotations__, FlockScenario)
    if isinstance(scenario.neighbor_rule, Topological) and "max_range" not in options:
        raise OptionError("max_range", "the largest number of neighbors, for a topological rule", "none")
    return EnvOptions(**options)


def line_options(options: LineOptionsDict) -> LineOptions:
    """Return the options of a line environment.

    Raises:
        OptionError: naming an option that is unknown or out of bounds.
    """
    check_names(options, LineOptionsDict.__annotations__, LineScenario)
    return LineOptions(**options)


def check_names(
    given: Mapping[str, object], known: Iterable[str], model: type[FlockScenario | LineScenario]
) -> None:
    """Check that all options exist.

    Args:
        given: options by name.
        known: names of the options.
        model: the scenario whose fields are often taken for options.

    Raises:
        OptionError: naming an option that does not exist, with the most similar one.
    """
    known = list(known)
    for name in given:
        if name in known:
            continue
        expected = "an option of the environment"
        if name in {field.name for field in dataclasses.fields(model)}:
            hint = f"a field of the scenario; pass scenario={model.__name__}({name}=...)"
        else:
            similar = get_close_matches(name, known, n=1)
            hint = "an unknown name; " + (
                f"did you mean {similar[0]}?" if similar else f"known: {', '.join(known)}"
            )
        raise OptionError(name, expected, hint)
