"""Action and observation spaces of range policies: maps between actions and ranges, observation entries."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Self

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_numbers
from flockesc_env.common.errors import InputError
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.options import ActionOptions, EnvOptions, LineOptions


def check_agents(actions: Collection[Any], agents: Collection[str]) -> None:
    """Check that exactly ``agents`` have actions."""
    acting = set(agents)
    for agent in actions:
        if agent not in acting:
            raise InputError(
                f"action of {agent!r}", "an agent in env.agents", "one that is unknown or caught"
            )
    for agent in agents:
        if agent not in actions:
            raise InputError(f"action of {agent!r}", "an action", "none")


class RangeActions:
    """The action space of one range, and the maps between actions and ranges.

    Attributes:
        mode: the option ``action_mode``.
        min_range: smallest range.
        max_range: largest range.
        grid: ranges of the action mode ``"discrete"``, shape (size,); ``None`` in other modes.
        core: the maps between actions and ranges in the compiled core.
    """

    def __init__(self, options: ActionOptions) -> None:
        self.mode, self.min_range, self.max_range = options.action_mode, options.min_range, options.max_range
        self._bounds = (-1.0, 1.0) if self.mode == "normalized" else (self.min_range, self.max_range)
        self.core = options.range_map()
        self.grid: FloatArray | None = None
        if self.core.grid is not None:
            self.grid = np.array(self.core.grid)
            self.grid.flags.writeable = False

    def space(self) -> gymnasium.Space[Any]:
        """Return a new action space for one range: a Box of shape (1,), or Discrete."""
        if self.grid is not None:
            return spaces.Discrete(len(self.grid))
        return spaces.Box(*self._bounds, (1,), np.float32)

    def to_range(self, action: Any, name: str = "action") -> float:
        """Return the range of a single action; ``name``: for errors, which are those of ``to_ranges``."""
        rho = self.core.of_one(action)
        if rho is None:
            rho = float(self._of_array(action, (), name)[0])
        if np.isnan(rho):
            raise self._outside(action, name)
        return rho

    def to_ranges(self, actions: Any, count: int, ignored: NDArray[np.bool] | None = None) -> FloatArray:
        """Return the ranges of stacked actions, shape (count,).

        Actions have shape (count, 1) and any real dtype or, if they are discrete, shape (count,) and any
        integer dtype. Those that are ``ignored``, shape (count,), are not checked; their range is 0.
        """
        ranges = self._of_array(actions, (count,), "action")
        if ignored is not None:
            ranges[ignored] = 0
        outside = np.isnan(ranges)
        if outside.any():
            first = int(outside.argmax())
            raise self._outside(np.asarray(actions).item(first), f"action[{first}]")
        return ranges

    def to_ranges_by_name(self, actions: list[Any], agents: list[str]) -> FloatArray:
        """Return the ranges of one action per agent, shape (len(agents),); errors name the agent."""
        ranges = self.core.of_each(actions)
        if ranges is None or np.isnan(ranges).any():
            named = zip(actions, agents, strict=True)
            ranges = np.array([self.to_range(action, f"action of {agent!r}") for action, agent in named])
        return ranges

    def _of_array(self, actions: Any, shape: tuple[int, ...], name: str) -> FloatArray:
        is_index = self.grid is not None
        shape = shape if is_index else (*shape, 1)
        return self.core.of_array(as_numbers(actions, name, shape, is_index=is_index))

    def _outside(self, action: Any, name: str) -> InputError:
        """Return the error for an action outside the action space."""
        value = np.asarray(action).item()
        if self.grid is not None:
            return InputError(name, f"an integer from 0 to {len(self.grid) - 1}", value)
        is_nan, (low, high) = np.isnan(value), self._bounds
        hint = (
            "a policy that returns NaN has diverged" if is_nan else "gymnasium.wrappers.ClipAction clips it"
        )
        return InputError(name, f"a number from {low} to {high} ({hint})", float(value))

    def from_ranges(self, ranges: FloatArray) -> NDArray[Any]:
        """Return the actions, shape (k, 1), of ranges in [``min_range``, ``max_range``], shape (k,).

        Discrete actions are the indices of the nearest ranges of the grid, int64 of shape (k,). Otherwise
        ``to_ranges`` returns the same ranges: exactly in the action mode ``"range"``, and within two units in
        the last place of ``max_range`` in the mode ``"normalized"``, because actions are float64.
        """
        actions = self.core.actions_of(ranges)
        return actions[:, None] if self.grid is None else actions.astype(np.int64)


@dataclass(frozen=True)
class ObservationLayout:
    """Names and bounds of the entries of an observation row (docs/model.md, "Observations").

    Attributes:
        names: names of the entries.
        low: lower bounds, shape (entries,).
        high: upper bounds, shape (entries,).
    """

    names: tuple[str, ...]
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    @classmethod
    def of(cls, entries: list[tuple[str, float, float]]) -> Self:
        """Return the layout of a list of (name, low, high)."""
        names, low, high = zip(*entries, strict=True)
        layout = cls(names, np.array(low, np.float32), np.array(high, np.float32))
        layout.low.flags.writeable = layout.high.flags.writeable = False
        return layout

    def space(self) -> gymnasium.Space[NDArray[np.float32]]:
        """Return a new observation space."""
        return spaces.Box(self.low, self.high, dtype=np.float32)

    def index(self, name: str) -> int:
        """Return the column of an entry."""
        if name not in self.names:
            raise InputError("observation", f"an entry {name!r}", f"only {', '.join(self.names)}")
        return self.names.index(name)


@dataclass(frozen=True)
class PolicySpec:
    """Shapes and meaning of the observations and actions of a policy.

    Attributes:
        actions: the action space, and the maps between actions and ranges.
        layout: names and bounds of the entries of an observation row.
        scenario: the scenario of the environment; the first one if flocks have different scenarios.
        options: the options of the environment.
        per_agent: True: one row and one action per agent. False: one per flock, or per line.
        num_steps: number of model steps of an episode; the largest if flocks have different scenarios.
        opponent: name of the policy that controls the ``Learned`` predators; ``None``: there is none.
    """

    actions: RangeActions
    layout: ObservationLayout
    scenario: FlockScenario | LineScenario
    options: EnvOptions | LineOptions
    per_agent: bool
    num_steps: int
    opponent: str | None = None

    def space(self) -> gymnasium.Space[Any]:
        """Return a new action space of one row."""
        return self.actions.space()

    @property
    def num_agents(self) -> int:
        """Number of agents per flock. Rows are ordered by flock, then by agent."""
        return self.scenario.num_agents

    @property
    def rows(self) -> int:
        """Number of rows, and of actions, per flock."""
        return self.num_agents if self.per_agent else 1

    @property
    def num_actions(self) -> int:
        """Number of actions of an episode that does not end early."""
        return -(-self.num_steps // self.options.steps_per_action)

    @property
    def profile_ranges(self) -> tuple[float, ...]:
        """Candidate ranges of the observation; empty without a profile."""
        return tuple(self.options.profile_ranges or ())

    @property
    def candidate_ranges(self) -> FloatArray:
        """The ranges that the actions of the candidates set, shape (candidates,).

        They are ``profile_ranges``, up to rounding in float64, or the nearest ranges of the grid of discrete
        actions.
        """
        actions = self.actions.from_ranges(np.array(self.profile_ranges))
        return self.actions.to_ranges(actions, len(self.profile_ranges))


def policy_spec(
    scenario: FlockScenario | LineScenario, options: EnvOptions | LineOptions, *, per_agent: bool = False
) -> PolicySpec:
    """Return the policy spec of an environment with this scenario and these options."""
    layout = ObservationLayout.of(options.entries(scenario, per_agent=per_agent))
    return PolicySpec(RangeActions(options), layout, scenario, options, per_agent, scenario.num_steps)
