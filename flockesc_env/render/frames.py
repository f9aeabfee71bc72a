"""The data of a picture of a flock: its state at one time, live or from a recorded run, and its title."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.common.errors import printable
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.registry import NAMES
from flockesc_env.scenario.flock import FlockScenario


@dataclass(frozen=True, eq=False)
class FlockFrame:
    """A flock at one time. Lengths in m, speeds in m/s.

    The range is that of the last step, shape (1,) or (n,). Before the first step it is that of the first
    action if the run is recorded, and empty in an environment.
    """

    scenario: FlockScenario  # as drawn
    step: int
    positions: FloatArray  # shape (n, D); a caught agent's is where it was caught
    velocities: FloatArray  # shape (n, D)
    predator_positions: FloatArray  # shape (P, D)
    predator_velocities: FloatArray  # shape (P, D)
    interaction_range: FloatArray
    caught: NDArray[np.bool]  # shape (n,)
    objective: str  # J so far, with its symbol and unit
    graph: tuple[FloatArray, FloatArray]  # positions and velocities that define it: the start's, if frozen
    view: FloatArray  # lowest and highest corner of a box around all positions so far, shape (2, D)
    trail: FloatArray  # past predator positions, shape (k, P, D)


LineHistory = Sequence[tuple[int, FloatArray, float]]
"""Number of steps made, x of shape (n,) and rho of the step before, 0 at the start; one row per action."""


def policy_title(name: str, unit: str = "m") -> str:
    """Return the title of a policy, for example "fixed range 12 m" for "fixed:12"; ``unit``: of a range."""
    if name.startswith("fixed:"):
        return printable(f"fixed range {name.removeprefix('fixed:')} {unit}")
    return f"rule: {name.replace('-', ' ')}" if name in NAMES else printable(name)


def initial_region(scenario: FlockScenario) -> FloatArray:
    """Return the lowest and highest corner of the region of a flock at the start, shape (2, D), in m."""
    high = np.full(scenario.dimension, scenario.periodic_side or scenario.initial_side)
    high[2:] *= not scenario.initial_plane
    return np.stack([np.zeros_like(high), high])


def enclose(view: FloatArray, *points: FloatArray) -> FloatArray:
    """Return the smallest box around the box ``view`` and points of shape (.., D), shape (2, D), in m."""
    rows = np.concatenate([view, *(each.reshape(-1, view.shape[1]) for each in points)])
    return np.stack([rows.min(axis=0), rows.max(axis=0)])


def recorded_view(run: Trajectory, step: int) -> FloatArray:
    """Return the view of a recorded run after ``step`` steps, shape (2, D), in m."""
    made = slice(step + 1)
    return enclose(initial_region(run.scenario), run.positions[made], run.predator_positions[made])


def recorded_frame(
    run: Trajectory, step: int, objective: str, trail: float, view: FloatArray | None = None
) -> FlockFrame:
    """Return the frame of a recorded run after ``step`` steps, with a trail of ``trail`` s."""
    spec = FLOCK_OBJECTIVES[objective]
    # The model moves predators by r_p(t + dt) = r_p(t) + dt v_p(t), which gives v_p by a forward difference.
    moved = min(step, run.scenario.num_steps - 1)
    before, after = run.predator_positions[moved : moved + 2]
    origin = 0 if run.scenario.frozen_graph else step
    return FlockFrame(
        scenario=run.scenario,
        step=step,
        positions=run.positions[step],
        velocities=run.velocities[step],
        predator_positions=run.predator_positions[step],
        predator_velocities=(after - before) / run.scenario.time_step,
        interaction_range=run.interaction_ranges[max(step - 1, 0)],
        caught=(run.caught_at >= 0) & (run.caught_at <= step),
        objective=f"{spec.symbol} {spec.text(getattr(run, spec.series)[: step + 1].min())}",
        graph=(run.positions[origin], run.velocities[origin]),
        view=recorded_view(run, step) if view is None else view,
        trail=run.predator_positions[step - int(min(trail / run.scenario.time_step, step)) : step + 1],
    )
