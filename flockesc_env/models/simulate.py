"""The two models as functions: one run, everything recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_floats, as_seed, as_threads
from flockesc_env.common.errors import ArgumentError, shown
from flockesc_env.episodes.seeds import fresh_seed
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.predators import Learned
from flockesc_env.scenario.presets import as_scenario

IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A run of the flock: T steps, one entry per time 0..T. Lengths in m, speeds in m/s, times in s.

    Attributes:
        scenario: the flock model's parameters, as drawn where it draws any.
        seed: the seed of everything random: of what of the start was not given, and of the predators.
        is_start_given: whether any of r(0) and v(0) was given; otherwise all of the run came from the seed.
        times: shape (T + 1,).
        interaction_ranges: rho in every step, shape (T, 1) or, with one range per agent, (T, n).
        predator_actions: of the L learned predators in every step, shape (T, L, D).
        positions: r_i(t), shape (T + 1, n, D).
        velocities: v_i(t), shape (T + 1, n, D).
        predator_positions: r_p(t), shape (T + 1, P, D).
        mean_distance: mean over agents of the distance to the nearest predator, shape (T + 1,); infinite
            without predators.
        min_distance: the minimum over agents, shape (T + 1,).
        num_components: connected components (weak ones where ranges differ) under the ranges of the step
            that begins at each time, at T of the step that has ended, shape (T + 1,).
        polarization: norm of the mean heading in [0, 1], shape (T + 1,).
        fraction_surviving: share of the agents that were not caught, shape (T + 1,).
        caught_at: the step, 1..T, that caught each agent, or -1, shape (n,). From that time on it rests where
            it was caught, with velocity 0, and no mean, minimum or count takes it in.
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


@dataclass(frozen=True, eq=False)
class LineTrajectory:
    """A run of the line: one entry per time 0..``steps``.

    Attributes:
        scenario: the line model's parameters.
        seed: the seed from which x(0) came, unless it was given.
        is_start_given: whether x(0) was given.
        interaction_range: rho.
        states: x(t), shape (steps + 1, n).
        num_components: m(t), shape (steps + 1,).
        escape_distance: d(t) = min_i |x_i - x_p|, shape (steps + 1,); infinite without a predator.
        converged: whether the last step moved no agent by more than the scenario's tolerance.
        steps: number of steps made.
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


def as_run(value: Any, field: str) -> Trajectory | LineTrajectory:
    """Return a run.

    Raises:
        ArgumentError: for anything else.
    """
    if not isinstance(value, Trajectory | LineTrajectory):
        raise ArgumentError(field, "a Trajectory or LineTrajectory", shown(value))
    return value


def as_runs(value: Any) -> list[tuple[str, Trajectory]]:
    """Return named runs of flocks, of which there is at least one.

    Raises:
        ArgumentError: for anything else.
    """
    if not isinstance(value, Sequence) or isinstance(value, str | bytes):
        raise ArgumentError("runs", "a list of runs", shown(value))
    if not value:
        raise ArgumentError("runs", "at least one run", "none")
    for index, run in enumerate(value):
        match run:
            case (str(), Trajectory()):
                pass
            case _:
                raise ArgumentError(f"runs[{index}]", "a name and a Trajectory", shown(run))
    return list(value)


def simulate(
    scenario: FlockScenario | str | None,
    interaction_range: ArrayLike,
    *,
    seed: int | None = None,
    initial_positions: ArrayLike | None = None,
    initial_velocities: ArrayLike | None = None,
    predator_actions: ArrayLike | None = None,
    num_threads: int | None = None,
) -> Trajectory:
    """Run a flock for ``scenario.num_steps`` steps.

    Args:
        scenario: the flock model's parameters, or a preset's name; ``None``: the paper's.
        interaction_range: rho in m: a scalar; (n,), one per agent; or a schedule with a row per step, (T,)
            or (T, n). Where n = T, write one range per agent as (1, n) and a schedule as (T, 1).
        seed: seed of the initial state, of the predators and of what the scenario draws, the same flock as
            ``env.reset(seed=seed)``; ``None``: a new one.
        initial_positions: r(0) in m, shape (n, D), in place of those of the seed.
        initial_velocities: v(0) in m/s, shape (n, D), likewise. With constant speed an agent is brought to
            speed v0 by its first step.
        predator_actions: of the L learned predators in every step, shape (T, L, D), in [-1, 1]; ``None``: 0,
            they fly straight on.
        num_threads: threads over which a large flock is spread; ``None``: one per core. The results do not
            depend on it.

    Raises:
        ArgumentError: naming the argument of a wrong type or shape, negative or not finite.
        ScenarioError: if ``scenario`` is neither a scenario of this model nor a preset's name.
    """
    scenario = as_scenario(scenario, FlockScenario)
    shape = (scenario.num_agents, scenario.dimension)
    positions = (
        None if initial_positions is None else as_floats(initial_positions, "initial_positions", shape)
    )
    velocities = (
        None if initial_velocities is None else as_floats(initial_velocities, "initial_velocities", shape)
    )
    start = _seed(seed)
    ranges = _schedule(interaction_range, scenario)
    threads = as_threads(num_threads)
    learned = sum(isinstance(predator, Learned) for predator in scenario.predators)
    steered = (scenario.num_steps, learned, scenario.dimension)
    controls = (
        np.zeros(steered)
        if predator_actions is None
        else as_floats(predator_actions, "predator_actions", steered)
    )
    document = scenario.to_json()
    run = _core.simulate_flock(document, ranges, start, positions, velocities, threads, controls)
    with np.errstate(over="ignore"):
        times: FloatArray = np.arange(scenario.num_steps + 1) * np.float64(scenario.time_step)
    in_force = np.broadcast_to(ranges, (scenario.num_steps, ranges.shape[1])).copy()
    return Trajectory(
        scenario=scenario.drawn(start),
        seed=start,
        is_start_given=positions is not None or velocities is not None,
        times=times,
        interaction_ranges=in_force,
        predator_actions=controls,
        **run,
    )


def simulate_line(
    scenario: LineScenario | str | None,
    interaction_range: float,
    *,
    seed: int | None = None,
    initial_state: ArrayLike | None = None,
) -> LineTrajectory:
    """Run a line under one range until it stands still, or for ``scenario.max_steps`` steps.

    Args:
        scenario: the line model's parameters, or a preset's name; ``None``: the paper's.
        interaction_range: rho.
        seed: seed of x(0) ~ U[0, 1]^n; ``None``: a new one.
        initial_state: x(0), shape (n,), in place of that of the seed.

    Raises:
        ArgumentError: naming the argument of a wrong type or shape, negative or not finite.
        ScenarioError: if ``scenario`` is neither a scenario of this model nor a preset's name.
    """
    scenario = as_scenario(scenario, LineScenario)
    states = (
        None if initial_state is None else as_floats(initial_state, "initial_state", (scenario.num_agents,))
    )
    start = _seed(seed)
    rho = float(as_floats(interaction_range, "interaction_range", (), least=0.0))
    run: dict[str, Any] = _core.simulate_line(scenario.to_json(), rho, start, states)
    return LineTrajectory(
        scenario=scenario, seed=start, is_start_given=states is not None, interaction_range=rho, **run
    )


def _seed(seed: int | None) -> int:
    return fresh_seed() if seed is None else as_seed(seed)


def _schedule(interaction_range: ArrayLike, scenario: FlockScenario) -> FloatArray:
    """Bring a range of any accepted shape to (1 or T, 1 or n)."""
    ranges = as_floats(interaction_range, "interaction_range", least=0.0)
    agents, steps = scenario.num_agents, scenario.num_steps
    if ranges.ndim == 0:
        return ranges.reshape(1, 1)
    if ranges.ndim == 1:
        if agents == steps and len(ranges) == agents > 1:
            expected = f"shape (1, {agents}) or ({steps}, 1), as there are as many agents as steps"
            raise ArgumentError("interaction_range", expected, f"shape {ranges.shape}")
        if len(ranges) == agents:
            return ranges.reshape(1, -1)
        if len(ranges) == steps:
            return ranges.reshape(-1, 1)
    if ranges.ndim == 2 and ranges.shape[0] in {1, steps} and ranges.shape[1] in {1, agents}:
        return ranges
    expected = f"a scalar or shape ({agents},), ({steps},) or ({steps}, {agents})"
    raise ArgumentError("interaction_range", expected, f"shape {ranges.shape}")
