"""Rendering of environments. An environment updates its viewer after each reset and step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.common.errors import ResetNeededError
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.render.frames import FlockFrame, enclose, initial_region
from flockesc_env.render.options import RenderMode, RenderOptions, as_mode_and_options, require_video
from flockesc_env.scenario.line import LineScenario

Image = NDArray[np.uint8]


class Viewer(ABC):
    """Pictures of an environment, as arrays or, in mode ``"human"``, in a window."""

    def __init__(self, mode: RenderMode, options: RenderOptions, fps: int) -> None:
        require_video("pygame")
        self._mode, self._options, self._fps = mode, options, fps

    @abstractmethod
    def images(self) -> list[Image]:
        """Return a picture of every flock, or of the line; raise ``ResetNeededError`` before a reset."""

    def render(self) -> list[Image] | None:
        """Return ``images`` or, in mode ``"human"``, show them."""
        images = self.images()
        if self._mode == "rgb_array":
            return images
        from flockesc_env.render.canvas import show  # loads pygame, an extra

        show(tiled(images), self._fps)
        return None

    def close(self) -> None:
        """Close the window, if there is one. It can be called again."""
        if self._mode == "human":
            from flockesc_env.render.canvas import close_window  # loads pygame, an extra

            close_window()


class FlockViewer(Viewer):
    """Pictures of the flocks of a batch."""

    def __init__(self, batch: FlockBatch, mode: RenderMode, options: RenderOptions, fps: int) -> None:
        super().__init__(mode, options, fps)
        self._batch = batch
        self._spec = FLOCK_OBJECTIVES[batch.options.objective]
        self._frames: list[FlockFrame | None] = [None] * batch.num_flocks

    def update(self) -> None:
        """Read the state of every flock, after a reset or a step."""
        objectives, caught = self._batch.metrics()[self._spec.name], self._batch.caught()
        for slot, last in enumerate(self._frames):
            state = self._batch.state(slot)
            del state["distances"]
            step, positions, predators = state["step"], state["positions"], state["predator_positions"]
            graph, trail = (positions, state["velocities"]), predators[np.newaxis]
            if last is None or step == 0:
                scenario = self._batch.drawn(slot)
                view = initial_region(scenario)
            elif last.step == step:
                continue
            else:
                scenario, view = last.scenario, last.view
                graph = last.graph if scenario.frozen_graph else graph
                seconds = scenario.time_step * self._batch.options.steps_per_action
                kept = len(last.trail) - int(min(self._options.trail / seconds, len(last.trail)))
                trail = np.concatenate([last.trail[kept:], trail])
            self._frames[slot] = FlockFrame(
                scenario=scenario,
                caught=caught[slot],
                objective=f"{self._spec.symbol} {self._spec.text(objectives[slot])}",
                graph=graph,
                view=enclose(view, positions, predators),
                trail=trail,
                **state if step else {**state, "interaction_range": np.empty(0)},
            )
        if self._mode == "human":
            self.render()

    def forget(self, slots: Sequence[int]) -> None:
        """Drop the history of some flocks."""
        for slot in slots:
            self._frames[slot] = None

    def images(self) -> list[Image]:
        """Return a picture of every flock, as ``Viewer.images``."""
        from flockesc_env.render.picture import draw_flock  # loads pygame, an extra

        frames = [frame for frame in self._frames if frame is not None]
        if len(frames) < len(self._frames):
            raise ResetNeededError("render() called before reset()")
        return [draw_flock(frame, self._options) for frame in frames]


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
        if self._mode == "human":
            self.render()

    def forget(self) -> None:
        """Drop the history of the line."""
        self._moments = []

    def images(self) -> list[Image]:
        """Return the picture of the line, as ``Viewer.images``."""
        from flockesc_env.render.picture import draw_line  # loads pygame, an extra

        if not self._moments:
            raise ResetNeededError("render() called before reset()")
        return [draw_line(self._scenario, self._moments, self._options)]


def flock_viewer(batch: FlockBatch, render_mode: Any, render_options: Any, fps: int) -> FlockViewer | None:
    """Return the viewer of a batch of flocks; ``None`` if the environment has no render mode."""
    mode, options = as_mode_and_options(render_mode, render_options)
    options.selected(batch.scenario.num_agents)
    return None if mode is None else FlockViewer(batch, mode, options, fps)


def line_viewer(scenario: LineScenario, render_mode: Any, render_options: Any, fps: int) -> LineViewer | None:
    """Return the viewer of a line; ``None`` if the environment has no render mode."""
    mode, options = as_mode_and_options(render_mode, render_options)
    return None if mode is None else LineViewer(scenario, mode, options, fps)


def render(viewer: Viewer | None) -> list[Image] | None:
    """Return a picture of every flock. Mode ``"human"`` shows them instead; without a mode, warn."""
    if viewer is not None:
        return viewer.render()
    advice = 'pass render_mode="rgb_array" or "human" to the constructor'
    gymnasium.logger.warn(f"render: no render mode was chosen; {advice}")
    return None


def frames_per_second(seconds: float) -> int:
    """Return the frame rate, 1 to 1000, at which actions of ``seconds`` of model time play in real time."""
    return max(1, round(min(1.0 / seconds, 1000.0)))


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
