"""``run_flock`` and ``simulate_line``: run a model once and return the whole trajectory."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_choice, as_count, as_floats, as_seed, as_threads
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.extras import data_frame
from flockesc_env.episodes.starts import fresh_seed
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    import polars as pl

IntArray = NDArray[np.int64]

RECORDED = (
    *("positions", "velocities", "predator_positions"),
    *("mean_distance", "min_distance", "num_components", "polarization", "fraction_surviving"),
)
"""Columns of a ``Trajectory`` that ``simulate`` records."""


class Displayed:
    """Base class of results: a short ``repr``, with the shapes of arrays."""

    def __repr__(self) -> str:
        facts = (f"{name}={_shape(value)}" for name, value in vars(self).items() if name != "scenario")
        return f"{type(self).__name__}({', '.join(facts)})"


def _shape(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _shape(each) for name, each in value.items()}
    return value.shape if isinstance(value, np.ndarray) else value


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Displayed):
    """A run of a flock with T steps, as ``simulate`` returns it.

    Arrays of length T + 1 have one entry per time 0, .., T; lengths in m, speeds in m/s, times in s. With
    ``simulate(.., every=k)`` T counts the recorded times after 0 instead of steps. A column that ``record``
    leaves out is empty. Tables raise ``MissingExtraError`` without the ``analysis`` extra.

    Attributes:
        scenario: the flock model's parameters; randomized fields have their drawn values.
        seed: seed of the initial state, the predators, noise and randomized fields.
        is_start_given: whether initial positions or velocities were given. If not, the seed determines the
            whole run.
        times: times t, shape (T + 1,).
        interaction_ranges: rho in the step after each time, shape (T, 1) or, with a range per agent, (T, n).
        predator_actions: actions of the L ``Learned`` predators in these steps, shape (T, L, D).
        positions: positions r_i(t), shape (T + 1, n, D).
        velocities: velocities v_i(t), shape (T + 1, n, D).
        predator_positions: positions of the P predators r_p(t), shape (T + 1, P, D).
        mean_distance: mean over agents of the distance to the nearest predator, shape (T + 1,); infinite
            without predators.
        min_distance: minimum over agents of this distance, shape (T + 1,).
        num_components: number of connected components (weak if ranges differ), shape (T + 1,). The entry of
            time t uses the ranges of the step from t to t + 1, the last entry those of the last step.
        polarization: norm of the mean heading, in [0, 1], shape (T + 1,).
        fraction_surviving: share of agents that are not caught, shape (T + 1,).
        caught_at: step 1, .., T in which each agent was caught, or -1, shape (n,). A caught agent stays where
            it was caught, with velocity 0, and does not count in means, minima and components.
    """

    scenario: FlockScenario
    seed: int
    is_start_given: bool
    times: FloatArray
    interaction_ranges: FloatArray
    predator_actions: FloatArray
    positions: FloatArray
    velocities: FloatArray
    predator_positions: FloatArray
    mean_distance: FloatArray
    min_distance: FloatArray
    num_components: IntArray
    polarization: FloatArray
    fraction_surviving: FloatArray
    caught_at: IntArray

    @property
    def is_caught(self) -> NDArray[np.bool]:
        """Whether each agent is caught at each time, shape (T + 1, n)."""
        steps = np.rint(self.times / self.scenario.time_step)
        return (self.caught_at >= 0) & (self.caught_at <= steps[:, np.newaxis])

    @property
    def is_complete(self) -> bool:
        """Whether all columns have been recorded in every step."""
        return all(len(getattr(self, name)) == self.scenario.num_steps + 1 for name in RECORDED)

    def table(self) -> pl.DataFrame:
        """Return a polars DataFrame with one row per time: distances, components, polarization, survivors.

        ``run.table().write_csv("run.csv")`` writes it; polars also writes Parquet and Excel.
        """
        columns = {name: getattr(self, name) for name in RECORDED[3:]}
        return data_frame({"time": self.times, **{name: row for name, row in columns.items() if len(row)}})

    def agents_table(self) -> pl.DataFrame:
        """Return a polars DataFrame with a row per time and agent: position, velocity, caught."""
        check_recorded(self, "record", "positions", "velocities")
        axes = "xyz"[: self.scenario.dimension]
        return data_frame(
            {
                **_rows(self.times, "agent", self.positions),
                **{f"v{axis}": self.velocities[..., i].ravel() for i, axis in enumerate(axes)},
                "is_caught": self.is_caught.ravel(),
            }
        )

    def predators_table(self) -> pl.DataFrame:
        """Return a polars DataFrame with a row per time and predator: position in m."""
        check_recorded(self, "record", "predator_positions")
        return data_frame(_rows(self.times, "predator", self.predator_positions))

    def catches_table(self) -> pl.DataFrame:
        """Return a polars DataFrame with a row per catch: time, agent, nearest predator and its distance."""
        check_recorded(self, "record", "positions", "predator_positions")
        if len(self.times) <= self.scenario.num_steps:
            raise InputError("every", "1, because a catch may lie between two recorded times", "a larger one")
        order = np.argsort(self.caught_at, kind="stable")
        agents = order[self.caught_at[order] >= 0]
        steps = self.caught_at[agents]
        offsets = self.predator_positions[steps] - self.positions[steps, agents][:, np.newaxis]
        distances = np.linalg.norm(offsets, axis=-1)
        return data_frame(
            {
                "time": self.times[steps],
                "agent": agents,
                "predator": np.array([row.argmin() for row in distances], np.int64),
                "distance": distances.min(axis=1, initial=np.inf),
            }
        )

    def unwrapped_positions(self) -> FloatArray:
        """Return positions without jumps at the borders of a periodic domain, shape (T + 1, n, D).

        Moves between two recorded times must be shorter than half of ``periodic_side``. In an open domain
        these are ``positions``.
        """
        check_recorded(self, "record", "positions")
        side = self.scenario.periodic_side
        return self.positions.copy() if side is None else np.unwrap(self.positions, axis=0, period=side)


def _rows(times: FloatArray, name: str, positions: FloatArray) -> dict[str, NDArray[Any]]:
    """Return the columns of a table with a row per time and body: time, index and coordinates."""
    steps, count, dimension = positions.shape
    axes = {axis: positions[..., index].ravel() for index, axis in enumerate("xyz"[:dimension])}
    return {"time": np.repeat(times, count), name: np.tile(np.arange(count), steps), **axes}


@dataclass(frozen=True, eq=False, repr=False)
class LineTrajectory(Displayed):
    """A run of a line, as ``simulate_line`` returns it; arrays have one entry per time 0, .., ``steps``.

    Its table raises ``MissingExtraError`` without the ``analysis`` extra.

    Attributes:
        scenario: the line model's parameters.
        seed: seed of x(0); unused if x(0) was given.
        is_start_given: whether x(0) was given.
        interaction_range: rho.
        states: positions x(t) of the agents, shape (steps + 1, n).
        num_components: number m(t) of connected components, shape (steps + 1,).
        escape_distance: d(t) = min_i ``|x_i - x_p|``, shape (steps + 1,); infinite without a predator.
        converged: whether the line reached its steady state: no agent moved by more than
            ``scenario.tolerance`` in the last step.
        steps: number of steps.
    """

    scenario: LineScenario
    seed: int
    is_start_given: bool
    interaction_range: float
    states: FloatArray
    num_components: IntArray
    escape_distance: FloatArray
    converged: bool
    steps: int

    def table(self) -> pl.DataFrame:
        """Return a polars DataFrame with one row per step: components, escape distance and all positions."""
        agents = {f"x_{agent}": states for agent, states in enumerate(self.states.T)}
        columns = {name: getattr(self, name) for name in ("num_components", "escape_distance")}
        return data_frame({"step": np.arange(len(self.states)), **columns, **agents})


def as_run(value: Any, field: str) -> Trajectory | LineTrajectory:
    """Return a run after a check of its type, and that it is complete."""
    if not isinstance(value, Trajectory | LineTrajectory):
        raise InputError(field, "a Trajectory or LineTrajectory", shown(value))
    if isinstance(value, Trajectory) and not value.is_complete:
        raise InputError(field, "a run with all columns in every step", "one made with every or record")
    return value


def check_recorded(run: Trajectory, field: str, *names: str) -> None:
    """Raise ``InputError`` on ``field`` unless a run has recorded these columns."""
    for name in names:
        if len(getattr(run, name)) != len(run.times):
            raise InputError(field, f"a run that has recorded {name}", "one without")


def as_runs(value: Any) -> list[tuple[str, Trajectory]]:
    """Return a list of pairs (name, run of a flock), all in the plane or all in space, after a check."""
    if not isinstance(value, Sequence) or isinstance(value, str | bytes):
        raise InputError("runs", "a list of runs", shown(value))
    if not value:
        raise InputError("runs", "at least one run", "none")
    for index, run in enumerate(value):
        match run:
            case (str(), Trajectory() as flock):
                as_run(flock, f"runs[{index}]")
            case _:
                raise InputError(f"runs[{index}]", "a name and a Trajectory", shown(run))
    if len({run.scenario.dimension for _, run in value}) > 1:
        raise InputError("runs", "all in the plane or all in space", "both")
    return list(value)


def run_flock(
    scenario: FlockScenario,
    ranges: ArrayLike,
    *,
    seed: int | None = None,
    initial_positions: ArrayLike | None = None,
    initial_velocities: ArrayLike | None = None,
    predator_actions: ArrayLike | None = None,
    num_threads: int | None = None,
    every: int = 1,
    record: Sequence[str] | None = None,
    stop: Event | None = None,
) -> Trajectory:
    """Run a flock with given ranges for ``scenario.num_steps`` steps; see ``flockesc_env.simulate``.

    The ranges rho are in m, a scalar, one per agent, shape (n,), or for every step, shape (T, 1) or (T, n).
    ``stop`` ends it between two steps with ``KeyboardInterrupt``, for threads that no signal reaches.
    Actions in [-1, 1] of the L ``Learned`` predators have shape (T, L, D); ``None``: 0, they fly straight on.
    """
    agents, steps, axes = scenario.num_agents, scenario.num_steps, scenario.dimension
    positions = optional_floats(initial_positions, "initial_positions", (agents, axes))
    velocities = optional_floats(initial_velocities, "initial_velocities", (agents, axes))
    start = seed_or_fresh(seed)
    given = as_floats(ranges, "interaction_range", least=0.0)
    if given.shape not in {(), (agents,), (steps, 1), (steps, agents)}:
        expected = f"a scalar or shape ({agents},), ({steps}, 1) or ({steps}, {agents})"
        raise InputError("interaction_range", expected, f"shape {given.shape}")
    per_step = np.atleast_2d(given)
    threads = as_threads(num_threads)
    actions_shape = (steps, scenario.num_learned, axes)
    accelerations = optional_floats(predator_actions, "predator_actions", actions_shape)
    if accelerations is None:
        accelerations = np.zeros(actions_shape)
    every = as_count(every, "every", most=steps)
    if isinstance(record, str) or not isinstance(record, Sequence | None):
        raise InputError("record", "a list of names", shown(record))
    names = RECORDED if record is None else [as_choice(name, "record", RECORDED) for name in record]
    points = {"positions": agents, "velocities": agents, "predator_positions": len(scenario.predators)}
    num_times = steps // every + 1
    shapes = {name: (num_times, *((points[name], axes) if name in points else ())) for name in names}
    _core.check_memory("num_steps", 8 * sum(map(math.prod, shapes.values())))
    columns: dict[str, Any] = {
        name: np.empty(shapes.get(name, 0), np.int64 if name == "num_components" else np.float64)
        for name in RECORDED
    }
    flock = _core.Flock(scenario.to_json(), start, positions, velocities, threads)
    rows = np.broadcast_to(per_step, (steps, per_step.shape[1]))
    for step in range(steps + 1):
        rho = rows[min(step, steps - 1)]
        if step % every == 0:
            for name in names:
                columns[name][step // every] = flock.get(name, rho)
        if stop is not None and stop.is_set():
            raise KeyboardInterrupt
        if step < steps:
            flock.step(rho, 1, accelerations[step], None)
    with np.errstate(over="ignore"):
        times: FloatArray = np.arange(0, steps + 1, every) * np.float64(scenario.time_step)
    last = (num_times - 1) * every
    return Trajectory(
        scenario=scenario.drawn(start),
        seed=start,
        is_start_given=positions is not None or velocities is not None,
        times=times,
        interaction_ranges=rows[:last:every].copy(),
        predator_actions=accelerations[:last:every].copy(),
        caught_at=flock.get("caught_at"),
        **columns,
    )


def simulate_line(
    scenario: LineScenario | str,
    interaction_range: float,
    *,
    seed: int | None = None,
    initial_state: ArrayLike | None = None,
) -> LineTrajectory:
    """Run a line with a fixed range until its steady state, or for ``scenario.max_steps`` steps.

    Args:
        scenario: the line model's parameters, or a preset's name.
        interaction_range: rho.
        seed: seed of x(0) ~ U[0, 1]^n; ``None``: a random seed from the operating system.
        initial_state: x(0), shape (n,); ``None``: drawn from the seed.

    Examples:
        >>> simulate_line("paper-line", 0.1, seed=7).num_components
        array([1, 2, 3, 3, 3, 3])
    """
    model = as_scenario(scenario, LineScenario)
    states = optional_floats(initial_state, "initial_state", (model.num_agents,))
    start = seed_or_fresh(seed)
    rho = float(as_floats(interaction_range, "interaction_range", (), least=0.0))
    run: dict[str, Any] = _core.simulate_line(model.to_json(), rho, start, states)
    is_given = states is not None
    return LineTrajectory(scenario=model, seed=start, is_start_given=is_given, interaction_range=rho, **run)


def optional_floats(value: ArrayLike | None, field: str, shape: tuple[int, ...]) -> FloatArray | None:
    """Return ``as_floats``, or ``None`` for ``None``."""
    return None if value is None else as_floats(value, field, shape)


def seed_or_fresh(seed: int | None) -> int:
    """Return a seed; ``None`` becomes a random one from the operating system."""
    return fresh_seed() if seed is None else as_seed(seed)
