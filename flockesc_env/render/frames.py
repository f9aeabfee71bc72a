"""Contents of pictures: their size, a flock at one time (of an environment or a run), a line, and titles."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_count
from flockesc_env.common.errors import InputError, printable
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.registry import NAMES
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

TRAIL = 3.0
"""Length of a predator's trail in s."""

SILENT = 1.0
"""Range below which an agent listens to nobody: it hardly ever has a neighbor."""


def as_size(value: Any, field: str = "size") -> int:
    """Return the width and height of a picture in pixels, an even number from 160 to 16384."""
    size = as_count(value, field, least=160, most=16_384)
    if size % 2:
        raise InputError(field, "an even number", size)
    return size


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
    lowest: float  # lowest mean predator distance so far
    view: FloatArray  # lowest and highest corner of a box around all positions so far, shape (2, D)
    trail: FloatArray  # past predator positions, shape (k, P, D)
    largest_range: float  # the end of the color scale
    rival: float = np.nan  # lowest mean predator distance so far of the best fixed range on the same flock
    color: str = LIGHT.ink  # of the ring around a predator


@dataclass(frozen=True, eq=False)
class LineFrame:
    """A line at the start and after each action: steps made, x of shape (n,), and rho, 0 at the start."""

    scenario: LineScenario
    history: Sequence[tuple[int, FloatArray, float]]
    largest_range: float  # the end of the color scale


def policy_title(name: str, unit: str = "m") -> str:
    """Return the title of a policy, for example "fixed range 12 m" for "fixed:12"; ``unit``: of a range."""
    if name.startswith("fixed:"):
        return printable(f"fixed range {name.removeprefix('fixed:')} {unit}")
    return f"rule: {name.replace('-', ' ')}" if name in NAMES else printable(name)


def policy_kind(name: str, run: Trajectory) -> str:
    """Return the kind of a recorded run's policy, which gives its color: "fixed", "rule" or "learned"."""
    return "fixed" if np.ptp(run.interaction_ranges) == 0 else "rule" if name in NAMES else "learned"


def listening(ranges: FloatArray, unit: str) -> list[tuple[str, float]]:
    """Return how far agents listen, as pieces of a sentence, each with the range that gives its color."""
    top = float(ranges.max())
    if top < SILENT or np.ptp(ranges) == 0:
        return [(f"all listen to {f'{top:.3g} {unit}' if top else 'nobody'}", top)]
    is_far, is_silent = ranges >= 0.95 * top, ranges < SILENT
    far, silent = (round(100 * float(which.mean())) for which in (is_far, is_silent))
    pieces = [(f"{far} of 100 listen to {top:.3g} {unit}", top), (f"{silent} to nobody", 0.0)]
    between = ranges[~is_far & ~is_silent]
    if len(between) >= 0.05 * len(ranges):
        pieces.append(("others between", float(np.median(between))))
    return pieces


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


def recorded_frame(run: Trajectory, step: int, view: FloatArray, largest_range: float) -> FlockFrame:
    """Return the frame of a recorded run after ``step`` steps."""
    spec = next(iter(FlockScenario.objectives.values()))
    # The model moves predators by r_p(t + dt) = r_p(t) + dt v_p(t), which gives v_p by a forward difference.
    moved = min(step, run.scenario.num_steps - 1)
    before, after = run.predator_positions[moved : moved + 2]
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
        lowest=float(run.mean_distance[: step + 1].min()),
        view=view,
        trail=run.predator_positions[step - int(min(TRAIL / run.scenario.time_step, step)) : step + 1],
        largest_range=largest_range,
    )


def live_frames(batch: FlockBatch, frames: Sequence[FlockFrame | None]) -> list[FlockFrame]:
    """Return the frames of all flocks after an action, from those before it (``None``: no history)."""
    spec = FlockScenario.objectives[batch.options.objective]
    metrics, caught, present = batch.core.metrics(), batch.core.caught(), list[FlockFrame]()
    for slot, last in enumerate(frames):
        state = batch.core.state(slot)
        del state["distances"]
        step, positions, predators = state["step"], state["positions"], state["predator_positions"]
        path = predators[np.newaxis]
        if last is None or step == 0:
            scenario = batch.drawn(slot)
            view = initial_region(scenario)
        elif last.step == step:
            present.append(last)
            continue
        else:
            scenario, view = last.scenario, last.view
            seconds = scenario.time_step * batch.options.steps_per_action
            kept = len(last.trail) - int(min(TRAIL / seconds, len(last.trail)))
            path = np.concatenate([last.trail[kept:], path])
        frame = FlockFrame(
            scenario=scenario,
            caught=caught[slot],
            objective=f"{spec.symbol} {spec.text(metrics[spec.name][slot])}",
            lowest=float(metrics["min_mean_distance"][slot]),
            view=enclose(view, positions, predators),
            trail=path,
            largest_range=batch.options.max_range,
            **state if step else {**state, "interaction_range": np.empty(0)},
        )
        present.append(frame)
    return present
