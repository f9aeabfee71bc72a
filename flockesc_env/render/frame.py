"""The data of a picture of a flock: its state and the episode so far, live or from a recorded run."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, ObjectiveSpec
from flockesc_env.models.simulate import Trajectory
from flockesc_env.render.camera import grow
from flockesc_env.scenario.flock import FlockScenario

_MARGIN = 0.06
"""Margin around all agents and predators, over the side of the initial region."""


@dataclass(frozen=True, eq=False)
class FlockMoment:
    """The state of a flock at one time. Lengths in m, speeds in m/s.

    Attributes:
        step: number of steps made.
        positions: r_i, shape (n, D).
        velocities: v_i, shape (n, D).
        predator_positions: r_p, shape (P, D).
        predator_velocities: v_p, shape (P, D).
        caught: True for caught agents, shape (n,); their positions are where they were caught.
        interaction_range: rho of the last step, shape (1,) or (n,). Before the first step it is that of the
            first action if the run is recorded, and empty in an environment.
        mean_distance: mean over agents of the distance to the nearest predator; infinite without predators.
        min_distance: the minimum over agents.
        objective: J so far.
    """

    step: int
    positions: FloatArray
    velocities: FloatArray
    predator_positions: FloatArray
    predator_velocities: FloatArray
    caught: NDArray[np.bool]
    interaction_range: FloatArray
    mean_distance: float
    min_distance: float
    objective: float

    @property
    def ranges(self) -> FloatArray:
        """The range of each agent, shape (n,); 0 before an environment's first action."""
        known = self.interaction_range if len(self.interaction_range) else 0.0
        return np.broadcast_to(known, len(self.positions))


@dataclass(frozen=True, eq=False)
class FlockFrame:
    """The last moment and the episode up to it. Lengths in m, times in s.

    Attributes:
        scenario: the flock model's parameters, as drawn.
        spec: the objective.
        moment: the last moment.
        listening: the moment whose positions and velocities define the neighbor graph, with the ranges of the
            last step: the last moment or, with a frozen graph, the first.
        view: lowest and highest corner of a box around all positions so far, shape (2, D); it never shrinks.
        series: times, mean distances, minimum distances and objectives, shape (4, k), one column per moment.
        trails: predator positions, shape (k, P, D).
    """

    scenario: FlockScenario
    spec: ObjectiveSpec
    moment: FlockMoment
    listening: FlockMoment
    view: FloatArray
    series: FloatArray
    trails: FloatArray


class FlockHistory:
    """Collects the moments of one episode into frames."""

    def __init__(self, scenario: FlockScenario, objective: ObjectiveSpec) -> None:
        self._scenario = scenario
        self._objective = objective
        self._margin = _MARGIN * scenario.initial_side
        low, high = np.zeros(scenario.dimension), np.full(scenario.dimension, scenario.initial_side)
        if scenario.initial_plane:
            high[2:] = 0.0
        self._view = np.stack([low - self._margin, high + self._margin])
        self._rows: list[tuple[float, float, float, float]] = []
        self._trails: list[FloatArray] = []
        self._last: FlockMoment | None = None
        self._frozen: FlockMoment | None = None

    def add(self, moment: FlockMoment) -> None:
        """Add the next moment. Adding a moment again changes nothing."""
        if self._last is not None and moment.step == self._last.step:
            return
        points = np.concatenate([moment.positions, moment.predator_positions])
        low, high = points.min(axis=0) - self._margin, points.max(axis=0) + self._margin
        self._view = grow(self._view, low, high)
        time = moment.step * self._scenario.time_step
        self._rows.append((time, moment.mean_distance, moment.min_distance, moment.objective))
        self._trails.append(moment.predator_positions)
        if self._scenario.frozen_graph and self._frozen is None and self._last is not None:
            self._frozen = replace(self._last, interaction_range=moment.interaction_range)
        self._last = moment

    def frame(self) -> FlockFrame | None:
        """Return the frame of the last moment; ``None`` before the first."""
        if self._last is None:
            return None
        return FlockFrame(
            scenario=self._scenario,
            spec=self._objective,
            moment=self._last,
            listening=self._frozen or self._last,
            view=self._view,
            series=np.array(self._rows).T,
            trails=np.array(self._trails),
        )


def shared_view(trajectories: Sequence[Trajectory]) -> FloatArray | None:
    """Return the smallest box that holds whole runs, shape (2, D); ``None`` if their dimensions differ."""
    views = [deque(recorded_frames(trajectory), 1)[0].view for trajectory in trajectories]
    if len({view.shape for view in views}) > 1:
        return None
    return reduce(lambda view, other: grow(view, *other), views)


def recorded_frames(trajectory: Trajectory, objective: str = "mean") -> Iterator[FlockFrame]:
    """Yield the frames of a recorded run at its times 0..T."""
    spec = FLOCK_OBJECTIVES[objective]
    history = FlockHistory(trajectory.scenario, spec)
    # The model moves predators by r_p(t + dt) = r_p(t) + dt v_p(t), which gives v_p by forward differences.
    moves = np.diff(trajectory.predator_positions, axis=0) / trajectory.scenario.time_step
    values = np.minimum.accumulate(getattr(trajectory, spec.series))
    for step, positions in enumerate(trajectory.positions):
        history.add(
            FlockMoment(
                step=step,
                positions=positions,
                velocities=trajectory.velocities[step],
                predator_positions=trajectory.predator_positions[step],
                predator_velocities=moves[min(step, len(moves) - 1)],
                caught=(trajectory.caught_at >= 0) & (trajectory.caught_at <= step),
                interaction_range=trajectory.interaction_ranges[max(step - 1, 0)],
                mean_distance=float(trajectory.mean_distance[step]),
                min_distance=float(trajectory.min_distance[step]),
                objective=float(values[step]),
            )
        )
        frame = history.frame()
        assert frame is not None  # noqa: S101, a moment was just added
        yield frame
