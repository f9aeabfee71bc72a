"""``run_flock`` and ``simulate_line``: run a model once and return the whole trajectory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_floats, as_seed, as_threads
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.extras import data_frame
from flockesc_env.episodes.starts import fresh_seed
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    import polars as pl

IntArray = NDArray[np.int64]


class Displayed(ABC):
    """Base class of results: a short ``repr``."""

    @abstractmethod
    def _summary(self) -> dict[str, object]:
        """Return what the ``repr`` shows, by name."""

    def __repr__(self) -> str:
        facts = (
            f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value}"
            for name, value in self._summary().items()
        )
        return f"{type(self).__name__}({', '.join(facts)})"


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Displayed):
    """A run of a flock with T steps, as ``simulate`` returns it.

    Arrays of length T + 1 have one entry per time 0, .., T; lengths in m, speeds in m/s, times in s. Tables
    raise ``MissingExtraError`` without the ``analysis`` extra.

    Attributes:
        scenario: the flock model's parameters; randomized fields have their drawn values.
        seed: seed of the initial state, the predators, noise and randomized fields.
        is_start_given: whether initial positions or velocities were given. If not, the seed determines the
            whole run.
        times: times t, shape (T + 1,).
        interaction_ranges: rho in every step, shape (T, 1) or, with one range per agent, (T, n).
        predator_actions: actions of the L ``Learned`` predators in every step, shape (T, L, D).
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

    def _summary(self) -> dict[str, object]:
        return {
            "num_agents": self.scenario.num_agents,
            "num_steps": self.scenario.num_steps,
            "seed": self.seed,
            **{
                spec.name: float(getattr(self, spec.series).min())
                for spec in self.scenario.objectives.values()
                if spec.is_defined_in(self.scenario)
            },
        }

    def table(self) -> pl.DataFrame:
        """Return a polars DataFrame with one row per time: distances, components, polarization, survivors.

        ``run.table().write_csv("run.csv")`` writes it; polars also writes Parquet and Excel.
        """
        names = ("mean_distance", "min_distance", "num_components", "polarization", "fraction_surviving")
        return data_frame({"time": self.times, **{name: getattr(self, name) for name in names}})

    def agents_table(self) -> pl.DataFrame:
        """Return a polars DataFrame with a row per time and agent: position, velocity, caught."""
        steps, _, dimension = self.positions.shape
        caught = np.where(self.caught_at < 0, steps, self.caught_at)
        return data_frame(
            {
                **_rows(self.times, "agent", self.positions),
                **{f"v{axis}": self.velocities[..., i].ravel() for i, axis in enumerate("xyz"[:dimension])},
                "is_caught": (np.arange(steps)[:, None] >= caught).ravel(),
            }
        )

    def predators_table(self) -> pl.DataFrame:
        """Return a polars DataFrame with a row per time and predator: position in m."""
        return data_frame(_rows(self.times, "predator", self.predator_positions))

    def catches_table(self) -> pl.DataFrame:
        """Return a polars DataFrame with a row per catch: time, agent, nearest predator and its distance."""
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

        Steps must be shorter than half of ``periodic_side``. In an open domain these are ``positions``.
        """
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

    def _summary(self) -> dict[str, object]:
        return {
            "num_agents": self.scenario.num_agents,
            "steps": self.steps,
            "seed": self.seed,
            "interaction_range": self.interaction_range,
            "escape_distance": float(self.escape_distance[-1]),
        }

    def table(self) -> pl.DataFrame:
        """Return a polars DataFrame with one row per step: components, escape distance and all positions."""
        names = ("num_components", "escape_distance")
        agents = {f"x_{agent}": states for agent, states in enumerate(self.states.T)}
        columns = {name: getattr(self, name) for name in names}
        return data_frame({"step": np.arange(len(self.states)), **columns, **agents})


def as_run(value: Any, field: str) -> Trajectory | LineTrajectory:
    """Return a run after a check of its type."""
    if not isinstance(value, Trajectory | LineTrajectory):
        raise InputError(field, "a Trajectory or LineTrajectory", shown(value))
    return value


def as_runs(value: Any) -> list[tuple[str, Trajectory]]:
    """Return a list of pairs (name, run of a flock) after a check of the types."""
    if not isinstance(value, Sequence) or isinstance(value, str | bytes):
        raise InputError("runs", "a list of runs", shown(value))
    if not value:
        raise InputError("runs", "at least one run", "none")
    for index, run in enumerate(value):
        match run:
            case (str(), Trajectory()):
                pass
            case _:
                raise InputError(f"runs[{index}]", "a name and a Trajectory", shown(run))
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
) -> Trajectory:
    """Run a flock with given ranges for ``scenario.num_steps`` steps; see ``flockesc_env.simulate``.

    The ranges rho are in m, a scalar, one per agent, shape (n,), or for every step, shape (T, 1) or (T, n).
    Actions in [-1, 1] of the L ``Learned`` predators have shape (T, L, D); ``None``: 0, they fly straight on.
    """
    agents, steps, axes = scenario.num_agents, scenario.num_steps, scenario.dimension
    positions = _given(initial_positions, "initial_positions", (agents, axes))
    velocities = _given(initial_velocities, "initial_velocities", (agents, axes))
    start = _seed(seed)
    given = as_floats(ranges, "interaction_range", least=0.0)
    if given.shape not in {(), (agents,), (steps, 1), (steps, agents)}:
        expected = f"a scalar or shape ({agents},), ({steps}, 1) or ({steps}, {agents})"
        raise InputError("interaction_range", expected, f"shape {given.shape}")
    per_step = np.atleast_2d(given)
    threads = as_threads(num_threads)
    actions_shape = (steps, scenario.num_learned, axes)
    accelerations = _given(predator_actions, "predator_actions", actions_shape)
    if accelerations is None:
        accelerations = np.zeros(actions_shape)
    document = scenario.to_json()
    run = _core.simulate_flock(document, per_step, start, positions, velocities, threads, accelerations)
    with np.errstate(over="ignore"):
        times: FloatArray = np.arange(steps + 1) * np.float64(scenario.time_step)
    return Trajectory(
        scenario=scenario.drawn(start),
        seed=start,
        is_start_given=positions is not None or velocities is not None,
        times=times,
        interaction_ranges=np.broadcast_to(per_step, (steps, per_step.shape[1])).copy(),
        predator_actions=accelerations,
        **run,
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

    Raises:
        InputError, MemoryError: as ``simulate``.

    Examples:
        >>> simulate_line("paper-line", 0.1, seed=7).num_components
        array([1, 2, 3, 3, 3, 3])
    """
    model = as_scenario(scenario, LineScenario)
    states = _given(initial_state, "initial_state", (model.num_agents,))
    start = _seed(seed)
    rho = float(as_floats(interaction_range, "interaction_range", (), least=0.0))
    run: dict[str, Any] = _core.simulate_line(model.to_json(), rho, start, states)
    is_given = states is not None
    return LineTrajectory(scenario=model, seed=start, is_start_given=is_given, interaction_range=rho, **run)


def _given(value: ArrayLike | None, field: str, shape: tuple[int, ...]) -> FloatArray | None:
    return None if value is None else as_floats(value, field, shape)


def _seed(seed: int | None) -> int:
    return fresh_seed() if seed is None else as_seed(seed)
