"""Contents of pictures: options, a flock at one time (of an environment or a run), a line, and titles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray, as_array, as_choice, as_count, as_floats, as_instance
from flockesc_env.common.errors import InputError, printable, shown
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.models.simulate import IntArray, Trajectory
from flockesc_env.policies.registry import NAMES
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

Show = Literal["none", "discs", "edges"]
ColorBy = Literal["component", "range"]


@dataclass(frozen=True, kw_only=True)
class RenderOptions:
    """Options of pictures. Pictures of a line use ``size`` only.

    Attributes:
        size: width and height in pixels, an even number from 160 to 16384.
        show: ``"edges"`` draws the edges of the neighbor graph, ``"discs"`` the interaction ranges as discs,
            or edges if a range is a number of neighbors; ``"none"`` draws neither.
        agents: indices of the agents whose discs or edges are drawn; ``None`` means all.
        trail: length of a predator's trail in s.
        color: what the color of an agent shows: its ``"component"`` or its interaction ``"range"``.
        largest_range: end of the color scale of ranges; ``None``: the largest range of the picture or, in a
            video, of all runs.

    Raises:
        InputError: if an option has a wrong type or is out of bounds; it names the option.
    """

    size: int = 512
    show: Show = "none"
    agents: tuple[int, ...] | None = None
    trail: float = 3.0
    color: ColorBy = "component"
    largest_range: float | None = None

    def __post_init__(self) -> None:
        size = as_count(self.size, "size", least=160, most=16_384)
        if size % 2:
            raise InputError("size", "an even number", size)
        as_choice(self.show, "show", get_args(Show))
        if self.agents is not None:
            agents = as_array(self.agents, "agents")
            if agents.ndim != 1 or not agents.size or agents.dtype.kind not in "iu" or agents.min() < 0:
                raise InputError("agents", "indices of agents", shown(self.agents))
            vars(self)["agents"] = tuple(agents.tolist())
        as_choice(self.color, "color", get_args(ColorBy))
        largest = self.largest_range
        if largest is not None:
            largest = float(as_floats(largest, "largest_range", (), least=0.0))
        trail = float(as_floats(self.trail, "trail", (), least=0.0))
        vars(self).update(largest_range=largest, trail=trail, size=size)

    def selected(self, num_agents: int) -> IntArray:
        """Return the indices of the agents to draw; raise ``InputError`` if one is out of bounds."""
        if self.agents is None:
            return np.arange(num_agents)
        if max(self.agents) >= num_agents:
            raise InputError("agents", f"indices below {num_agents}", max(self.agents))
        return np.array(self.agents)


def as_render_options(value: Any) -> RenderOptions:
    """Return render options, the defaults for ``None``; anything else raises ``InputError``."""
    return RenderOptions() if value is None else as_instance(value, "render_options", RenderOptions)


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


@dataclass(frozen=True, eq=False)
class LineFrame:
    """A line at the start and after each action: steps made, x of shape (n,), and rho, 0 at the start."""

    scenario: LineScenario
    history: Sequence[tuple[int, FloatArray, float]]


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


def live_frames(batch: FlockBatch, frames: Sequence[FlockFrame | None], trail: float) -> list[FlockFrame]:
    """Return the frames of all flocks after an action, from those before it (``None``: no history).

    Trails are ``trail`` s long.
    """
    spec = FLOCK_OBJECTIVES[batch.options.objective]
    objectives, caught, present = batch.core.metrics()[spec.name], batch.core.caught(), list[FlockFrame]()
    for slot, last in enumerate(frames):
        state = batch.core.state(slot)
        del state["distances"]
        step, positions, predators = state["step"], state["positions"], state["predator_positions"]
        graph, path = (positions, state["velocities"]), predators[np.newaxis]
        if last is None or step == 0:
            scenario = batch.drawn(slot)
            view = initial_region(scenario)
        elif last.step == step:
            present.append(last)
            continue
        else:
            scenario, view = last.scenario, last.view
            graph = last.graph if scenario.frozen_graph else graph
            seconds = scenario.time_step * batch.options.steps_per_action
            kept = len(last.trail) - int(min(trail / seconds, len(last.trail)))
            path = np.concatenate([last.trail[kept:], path])
        frame = FlockFrame(
            scenario=scenario,
            caught=caught[slot],
            objective=f"{spec.symbol} {spec.text(objectives[slot])}",
            graph=graph,
            view=enclose(view, positions, predators),
            trail=path,
            **state if step else {**state, "interaction_range": np.empty(0)},
        )
        present.append(frame)
    return present
