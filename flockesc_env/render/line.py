"""The picture of a line: its states over time, colored by component."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flockesc_env.common.checks import FloatArray
from flockesc_env.models.simulate import IntArray, LineTrajectory
from flockesc_env.render.camera import Rect
from flockesc_env.render.canvas import Canvas, Image
from flockesc_env.render.colors import FAINT_TEXT, GRID, PREDATOR, TEXT, Color, component_colors, faded
from flockesc_env.render.ground import nice
from flockesc_env.render.options import RenderOptions
from flockesc_env.scenario.line import LineScenario

_FIRST_STEPS = 10
"""Length of the time axis at the start; it grows with the episode."""

_SMALL = 0.034
"""Height of the numbers of the axes, over the width of the picture."""


@dataclass(frozen=True, eq=False)
class LineFrame:
    """The data of a picture of a line: its states at the times of its actions so far.

    Attributes:
        scenario: the line model's parameters.
        steps: numbers of steps made, shape (k,).
        states: x at these times, shape (k, n).
        interaction_ranges: rho of the step before each of these times, shape (k,); 0 at the start.
    """

    scenario: LineScenario
    steps: IntArray
    states: FloatArray
    interaction_ranges: FloatArray


def recorded_line(trajectory: LineTrajectory, step: int) -> LineFrame:
    """Return the frame of a recorded run after ``step`` steps."""
    ranges = np.full(step + 1, trajectory.interaction_range)
    ranges[0] = 0.0
    return LineFrame(trajectory.scenario, np.arange(step + 1), trajectory.states[: step + 1], ranges)


def line_labels(states: FloatArray, interaction_range: float) -> IntArray:
    """Return the component of every agent of a line, shape (n,), labeled by the lowest index in it."""
    order = np.argsort(states, kind="stable")
    component = np.concatenate([[0], np.cumsum(np.diff(states[order]) > interaction_range)])
    lowest = np.full(len(states), len(states))
    np.minimum.at(lowest, component, order)
    labels = np.empty(len(states), np.int64)
    labels[order] = lowest[component]
    return labels


def draw_line(frame: LineFrame, options: RenderOptions, title: str = "") -> Image:
    """Return the picture of a line, shape (size, size, 3). Equal frames give equal pictures."""
    canvas = Canvas(options.size)
    labels = [line_labels(*each) for each in zip(frame.states, frame.interaction_ranges, strict=True)]
    axes = _Axes(canvas, frame)
    axes.draw()
    colors = [component_colors(each) for each in labels]
    for t in range(1, len(labels)):
        ends = np.stack([axes.at(frame.steps[t - 1 + k], frame.states[t - 1 + k]) for k in (0, 1)], axis=1)
        # Agents with equal states stay together, so one line stands for all of them.
        _, kept = np.unique(np.round(ends.reshape(-1, 4), 1), axis=0, return_index=True)
        canvas.segments(ends[kept], colors[t][kept].tolist(), 0.0025 * canvas.size)
    canvas.dots(axes.at(frame.steps[-1], frame.states[-1]), 0.006 * canvas.size, colors[-1].tolist())
    _words(canvas, frame, title, num_components=len(np.unique(labels[-1])))
    return canvas.image()


class _Axes:
    """Axes of time (right) and state (up). They include all states so far and never shrink."""

    def __init__(self, canvas: Canvas, frame: LineFrame) -> None:
        self._canvas, self._scenario = canvas, frame.scenario
        size = canvas.size
        self._plot = Rect(0.085 * size, 0.125 * size, 0.885 * size, 0.77 * size)
        self._end = nice(max(_FIRST_STEPS, frame.steps[-1]))
        self._low, self._high = min(0.0, frame.states.min()) - 0.04, max(1.0, frame.states.max()) + 0.04

    def at(self, steps: ArrayLike, states: ArrayLike) -> FloatArray:
        """Return the pixels of states at times, shape (.., 2)."""
        x = self._plot.left + self._plot.width * np.asarray(steps) / self._end
        share = (np.asarray(states) - self._low) / (self._high - self._low)
        return np.stack(np.broadcast_arrays(x, self._plot.bottom - self._plot.height * share), axis=-1)

    def draw(self) -> None:
        """Draw the axes with their numbers, and the position and range of the predator."""
        canvas, size, place = self._canvas, self._canvas.size, self._scenario.predator_position
        if place is not None:
            reach = self._scenario.predator_range
            (left, top), (right, bottom) = self.at([0, self._end], [place + reach, place - reach]).tolist()
            top, bottom = max(top, self._plot.top), min(bottom, self._plot.bottom)
            canvas.fill(Rect(left, top, right - left, bottom - top), _pale_red(0.9))
        spacing, tick = nice((self._high - self._low) / 8), nice(self._end / 8)
        for count in range(int(np.ceil(self._low / spacing)), int(np.floor(self._high / spacing)) + 1):
            line = self.at([0, self._end], count * spacing)
            canvas.segments(line[np.newaxis], [GRID])
            label = f"{count * spacing:.4g}"
            canvas.text(label, (line[0, 0] - 0.012 * size, line[0, 1]), FAINT_TEXT, "midright", _SMALL)
        for step in np.arange(0.0, self._end + tick / 2, tick):
            x, y = self.at(step, self._low).tolist()
            canvas.text(f"{step:g}", (x, y + 0.012 * size), FAINT_TEXT, "midtop", _SMALL)
        middle = self._plot.left + self._plot.width / 2
        canvas.text("steps", (middle, self._plot.bottom + 0.055 * size), FAINT_TEXT, "midtop", _SMALL)
        if place is not None:
            canvas.segments(self.at([0, self._end], place)[np.newaxis], [_pale_red(0.25)], 0.004 * size)


def _words(canvas: Canvas, frame: LineFrame, title: str, *, num_components: int) -> None:
    size, place = canvas.size, frame.scenario.predator_position
    one = "" if num_components == 1 else "s"
    words = [
        (f"t = {frame.steps[-1]}", 0.022),
        (f"range {frame.interaction_ranges[-1]:.3g}", 0.16),
        (f"{num_components} component{one}", 0.36),
    ]
    if place is not None:
        words.append((f"escape distance {np.abs(frame.states[-1] - place).min():.3f}", 0.63))
    for word, at in words:
        canvas.text(word, (at * size, 0.02 * size), TEXT, height=0.04)
    canvas.text(title, (0.022 * size, 0.068 * size), TEXT, height=0.044)


def _pale_red(share: float) -> Color:
    red, green, blue = faded(PREDATOR, share).tolist()
    return red, green, blue
