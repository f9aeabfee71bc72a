"""Viewers of environments. An environment updates its viewer after each reset and step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from flockesc_env.common.checks import FloatArray
from flockesc_env.common.errors import ResetNeededError
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.render.canvas import Image
from flockesc_env.render.flock import draw_flock
from flockesc_env.render.frame import FlockHistory, FlockMoment
from flockesc_env.render.line import LineFrame, draw_line
from flockesc_env.render.options import RenderMode, RenderOptions
from flockesc_env.render.window import Window
from flockesc_env.scenario.line import LineScenario


class Viewer(ABC):
    """Pictures of an environment, as arrays or, in mode ``"human"``, in a window."""

    def __init__(self, mode: RenderMode, options: RenderOptions, fps: int) -> None:
        self._options = options
        self._window = Window(fps) if mode == "human" else None

    @abstractmethod
    def images(self) -> list[Image]:
        """Return a picture of every flock, or of the line; raise ``ResetNeededError`` before a reset."""

    def render(self) -> list[Image] | None:
        """Return ``images`` or, in mode ``"human"``, show them."""
        if self._window is None:
            return self.images()
        self._window.show(tiled(self.images()))
        return None

    def close(self) -> None:
        """Close the window, if there is one. It can be called again."""
        if self._window is not None:
            self._window.close()

    def _show(self) -> None:
        """Show the new state in mode ``"human"``."""
        if self._window is not None:
            self.render()


class FlockViewer(Viewer):
    """Pictures of the flocks of a batch."""

    def __init__(self, batch: FlockBatch, mode: RenderMode, options: RenderOptions, fps: int) -> None:
        super().__init__(mode, options, fps)
        self._batch = batch
        self._objective = FLOCK_OBJECTIVES[batch.options.objective]
        self._histories = [FlockHistory(batch.scenario, self._objective) for _ in range(batch.num_flocks)]

    def update(self) -> None:
        """Read the state of every flock, after a reset or a step."""
        metrics = self._batch.metrics()
        caught = self._batch.caught()
        objective = metrics[self._objective.column]
        for slot in range(self._batch.num_flocks):
            state = self._batch.state(slot)
            if state["step"] == 0:
                self.forget([slot])
            self._histories[slot].add(
                FlockMoment(
                    step=state["step"],
                    positions=state["positions"],
                    velocities=state["velocities"],
                    predator_positions=state["predator_positions"],
                    predator_velocities=state["predator_velocities"],
                    caught=caught[slot],
                    interaction_range=state["interaction_range"] if state["step"] else np.empty(0),
                    mean_distance=float(metrics["mean_distance"][slot]),
                    min_distance=float(metrics["min_distance"][slot]),
                    objective=float(objective[slot]),
                )
            )
        self._show()

    def forget(self, slots: Sequence[int]) -> None:
        """Drop the history of some flocks."""
        for slot in slots:
            self._histories[slot] = FlockHistory(self._batch.drawn(slot), self._objective)

    def images(self) -> list[Image]:
        """Return a picture of every flock, as ``Viewer.images``."""
        frames = [history.frame() for history in self._histories]
        started = [frame for frame in frames if frame is not None]
        if len(started) < len(frames):
            raise ResetNeededError("render() called before reset()")
        return [draw_flock(frame, self._options) for frame in started]


class LineViewer(Viewer):
    """The picture of a line."""

    def __init__(self, scenario: LineScenario, mode: RenderMode, options: RenderOptions, fps: int) -> None:
        super().__init__(mode, options, fps)
        self._scenario = scenario
        self._moments: list[tuple[int, FloatArray, float]] = []

    def update(self, steps: int, states: FloatArray, interaction_range: float) -> None:
        """Add the moment after ``steps`` steps, with states x of shape (n,) and rho of the last step."""
        if steps == 0:
            self.forget()
        self._moments.append((steps, states, interaction_range))
        self._show()

    def forget(self) -> None:
        """Drop the history of the line."""
        self._moments = []

    def images(self) -> list[Image]:
        """Return the picture of the line, as ``Viewer.images``."""
        if not self._moments:
            raise ResetNeededError("render() called before reset()")
        steps, states, ranges = (np.array(column) for column in zip(*self._moments, strict=True))
        return [draw_line(LineFrame(self._scenario, steps, states, ranges), self._options)]


def grid_shape(count: int) -> tuple[int, int]:
    """Return the columns and rows of a grid of pictures, about as many rows as columns."""
    columns = int(np.ceil(np.sqrt(count)))
    return columns, -(-count // columns)


def tiled(images: list[Image]) -> Image:
    """Arrange pictures of one size in a grid."""
    columns, rows = grid_shape(len(images))
    blank = np.full_like(images[0], 255)
    filled = [*images, *[blank] * (rows * columns - len(images))]
    return np.vstack([np.hstack(filled[row * columns : (row + 1) * columns]) for row in range(rows)])
