"""Options of the environments: actions, rewards and observations."""

import dataclasses
import json
import math
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Self, TypedDict, get_args

from flockesc_env import _core
from flockesc_env.common.checks import as_choice, as_count, as_flag, as_floats, as_vector
from flockesc_env.common.errors import InputError, shown
from flockesc_env.scenario.objectives import Objective

ActionMode = Literal["normalized", "range", "discrete"]
TeamReward = Literal["team", "distance", "terminal"]
IndividualReward = Literal["individual_distance", "individual_distance_change", "individual", "difference"]
Reward = Literal[TeamReward, IndividualReward]
LineReward = Literal["change", "terminal"]
ExtraEntries = Literal["escape_direction", "closest_approach"]


PROFILE_RANGES = (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)
"""Candidate ranges in m that suit the paper's flock, for the option ``profile_ranges``."""

UNOBSERVED = ("reward", "range_cost", "count_components")
"""Options that change neither observations nor actions."""

FREE = ("action_mode", "min_range", "range_grid", *UNOBSERVED)
"""Options that a policy chooses itself when it plays a task."""

VIEWS = {False: "flock", True: "agent"}
"""What a range and an observation row belong to, by ``per_agent``: names of the core."""


@dataclass(frozen=True, kw_only=True)
class ActionOptions:
    """Options of the action space: how an action sets the interaction range.

    Attributes:
        action_mode: ``"normalized"``: Box [-1, 1], mapped to [``min_range``, ``max_range``].
            ``"range"``: Box [``min_range``, ``max_range``], the range itself.
            ``"discrete"``: Discrete, an index into ``range_grid``.
        min_range: smallest range, at least 0, in m for a flock.
        max_range: largest range, above ``min_range``, in m for a flock. With a topological neighbor rule
            ranges are numbers of neighbors, and ``max_range`` is required.
        range_grid: ranges of the action mode ``"discrete"``; ``None``: 21 equally spaced ranges from
            ``min_range`` to ``max_range``.
        steps_per_action: number of model steps per action. The last action of an episode may last fewer.
    """

    action_mode: ActionMode = "normalized"
    min_range: float = 0.0
    max_range: float = 40.0
    range_grid: Sequence[float] | None = None
    steps_per_action: int = 4

    def __post_init__(self) -> None:
        as_choice(self.action_mode, "action_mode", get_args(ActionMode))
        grid, checked = self.range_grid, vars(self)
        checked["min_range"] = float(as_floats(self.min_range, "min_range", ()))
        checked["max_range"] = float(as_floats(self.max_range, "max_range", ()))
        if grid is not None:
            checked["range_grid"] = tuple(as_vector(grid, "range_grid").tolist())
        checked["steps_per_action"] = as_count(self.steps_per_action, "steps_per_action")
        self.range_map()  # raises if one is out of bounds

    @classmethod
    def among(cls, arguments: Mapping[str, Any]) -> Self:
        """Return the options among keyword arguments of an environment; the others are ignored."""
        names = [field.name for field in dataclasses.fields(cls) if field.name in arguments]
        return cls(**{name: arguments[name] for name in names})

    def range_map(self) -> _core.RangeMap:
        """Return the maps between actions and ranges in the compiled core."""
        names = [field.name for field in dataclasses.fields(ActionOptions)]
        return _core.RangeMap(json.dumps({name: getattr(self, name) for name in names}))

    @abstractmethod
    def entries(self, scenario: Any, *, per_agent: bool) -> list[tuple[str, float, float]]:
        """Return the names and bounds of the entries of an observation row in a scenario."""


@dataclass(frozen=True, kw_only=True)
class EnvOptions(ActionOptions):
    """Options of the flock environments.

    Attributes:
        objective: name of the objective (docs/model.md, "Objectives"). J is the minimum over time of a value.
        reward: one of the team rewards, which are equal for all agents. Let v_t be the value of the objective
            at time t and m_t its running minimum.
            ``"team"``: m_t - m_(t-1), so that the return is the objective minus v_0;
            ``"distance"``: v_t, divided by the number of steps;
            ``"terminal"``: the objective minus v_0, in the last step.
            With one range per agent also an individual reward, where d_i is the predator distance of agent i:
            ``"individual_distance"``: d_i, divided by the number of steps;
            ``"individual_distance_change"``: d_i(t) - d_i(t-1);
            ``"individual"``: the agent's part of ``"team"`` of the mean distance: d_i(t) minus d_i when m
            fell before, in steps in which m falls, otherwise 0;
            ``"difference"``: the difference reward (Wolpert and Tumer): v_t minus its value if this agent had
            range 0 during the action. It simulates the action once more per agent.
        range_cost: reward that an action costs per m: the reward of an action is lowered by it times the mean
            range of the agents that are not caught or, with an individual reward, the agent's own range.
        predator_sensing_range: distance in m up to which agents observe a predator; ``math.inf``: any
            distance.
        count_components: whether ``info`` contains ``num_components``. The count costs a graph search per
            action.
        profile_ranges: candidate ranges, in ascending order and up to ``max_range``, for example
            ``PROFILE_RANGES``. Every agent then observes what it would hear under each of them
            (docs/model.md, "Profile"). ``None``: no profile, as always with one range for the flock.
        extra_entries: optional entries of the observation. ``"escape_direction"``: the direction away from
            the place of the predator at its closest approach to the flock. ``"closest_approach"``: distance
            and time of the closest approach of the predator.
    """

    objective: Objective = "min_mean_distance"
    reward: Reward = "team"
    range_cost: float = 0.0
    predator_sensing_range: float = math.inf
    count_components: bool = False
    profile_ranges: Sequence[float] | None = None
    extra_entries: Sequence[ExtraEntries] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        as_choice(self.objective, "objective", get_args(Objective))
        as_choice(self.reward, "reward", get_args(Reward))
        sensing: Any = self.predator_sensing_range
        if sensing is None or isinstance(sensing, str):
            expected = "a distance in m (math.inf: agents see the predator at any distance)"
            raise InputError("predator_sensing_range", expected, shown(sensing))
        if isinstance(sensing, float) and sensing == math.inf:
            sensing = math.inf  # not a number of NumPy
        else:
            sensing = float(as_floats(sensing, "predator_sensing_range", (), least=0.0))
        ranges, entries = self.profile_ranges, self.extra_entries
        if isinstance(entries, str) or not isinstance(entries, Sequence):
            expected = f"a list of {', '.join(get_args(ExtraEntries))}"
            raise InputError("extra_entries", expected, shown(entries))
        for index, name in enumerate(entries):
            as_choice(name, f"extra_entries[{index}]", get_args(ExtraEntries))
        vars(self).update(
            range_cost=float(as_floats(self.range_cost, "range_cost", ())),
            predator_sensing_range=sensing,
            count_components=as_flag(self.count_components, "count_components"),
            extra_entries=tuple(entries),
        )
        if ranges is not None:
            vars(self)["profile_ranges"] = tuple(as_vector(ranges, "profile_ranges").tolist())
        _core.observation_entries(self.to_core(per_agent=True), 2)  # raises if one is out of bounds

    def entries(self, scenario: Any, *, per_agent: bool) -> list[tuple[str, float, float]]:
        """Return the names and bounds of the entries of an observation row in a scenario."""
        return _core.observation_entries(self.to_core(per_agent=per_agent), scenario.dimension)

    def to_core(self, *, per_agent: bool = False, max_actions: int | None = None) -> str:
        """Return the options as JSON for the compiled core, with the limit of actions of an episode."""
        names = ("objective", "reward", "range_cost", "max_range", "predator_sensing_range")
        document = {name: getattr(self, name) for name in (*names, "steps_per_action", "extra_entries")}
        document |= {"view": VIEWS[per_agent], "profile_ranges": self.profile_ranges or ()}
        document["max_actions"] = max_actions
        return json.dumps(to_plain(document))


@dataclass(frozen=True, kw_only=True)
class LineOptions(ActionOptions):
    """Options of the line environment.

    Attributes:
        max_range: largest range; the default 1 is the length of the initial interval.
        steps_per_action: see ``ActionOptions``; the default is 1.
        reward: ``"change"``: d(t) - d(t-1), where d is the escape distance, so that the return is
            d_ss - d(0). ``"terminal"``: the same sum, in the last step.
    """

    profile_ranges = None  # no field: the line has no profile

    max_range: float = 1.0
    steps_per_action: int = 1
    reward: LineReward = "change"

    def __post_init__(self) -> None:
        super().__post_init__()
        as_choice(self.reward, "reward", get_args(LineReward))

    def entries(self, scenario: Any, **_: bool) -> list[tuple[str, float, float]]:
        """Return the names and bounds of the entries of a row, which agents of a line share."""
        return _core.line_observation_entries(scenario.num_agents)

    def to_core(self) -> str:
        """Return the options as JSON, for the compiled core."""
        names = ("reward", "max_range", "steps_per_action")
        return json.dumps({name: getattr(self, name) for name in names})


def to_plain(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options for JSON, where null stands for infinity."""
    return {name: None if value == math.inf else value for name, value in options.items()}


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
    range_cost: float
    predator_sensing_range: float
    count_components: bool
    profile_ranges: Sequence[float] | None
    extra_entries: Sequence[ExtraEntries]


class LineOptionsDict(ActionOptionsDict, total=False):
    """``LineOptions`` as keyword arguments."""

    reward: LineReward


def check_names(scenario: Any, given: Iterable[str], known: type, own: Iterable[str] = ()) -> None:
    """Refuse keyword arguments of an environment that are not in a ``TypedDict`` of all that it accepts.

    The error for an unknown name suggests the most similar one, also of the environment's ``own`` arguments.
    """
    names = [*own, *known.__annotations__]
    for name in (name for name in given if name not in names):
        if name in {field.name for field in dataclasses.fields(scenario)}:
            hint = f"a field of the scenario; pass scenario={type(scenario).__name__}({name}=...)"
            raise InputError(name, "an option of the environment", hint)
        as_choice(name, name, names)
