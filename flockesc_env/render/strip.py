"""The strip below a flock: time, range, and the predator distances now and so far."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flockesc_env.common.checks import FloatArray
from flockesc_env.render.camera import Rect
from flockesc_env.render.canvas import Canvas
from flockesc_env.render.colors import FAINT_TEXT, FRAME, GRID, MEAN, MINIMUM, PREDATOR, TEXT
from flockesc_env.render.frame import FlockFrame
from flockesc_env.render.ground import nice


def draw_strip(canvas: Canvas, frame: FlockFrame, rect: Rect) -> None:
    """Draw the text, and the mean and minimum distance over the time of the episode."""
    size, moment, spec = canvas.size, frame.moment, frame.spec
    canvas.fill(Rect(rect.left, rect.top, rect.width, max(1.0, 0.002 * size)), FRAME)
    left, right, row = 0.022 * size, 0.978 * size, rect.top + 0.016 * size
    canvas.text(f"{frame.series[0, -1]:.1f} s", (left, row), TEXT)
    words = range_text(moment.interaction_range, frame.scenario.neighbor_rule.unit)
    canvas.text(words, (0.2 * size, row), TEXT)
    if moment.caught.any():
        canvas.text(f"{moment.caught.sum()} caught", (right, row), PREDATOR, "topright")
    row += 0.056 * size
    if not len(moment.predator_positions):
        canvas.text("no predator", (left, row), TEXT)
        return
    left += canvas.text(f"mean {moment.mean_distance:.0f} m", (left, row), MEAN) + 0.03 * size
    canvas.text(f"min {moment.min_distance:.0f} m", (left, row), MINIMUM)
    is_length = spec.unit == "m"  # then J is the lowest point of a curve
    words = f"{'lowest' if is_length else spec.symbol} {spec.text(moment.objective)}"
    width = canvas.text(words, (right, row), TEXT, "topright")
    if is_length:
        canvas.dots(np.array([(right - width - 0.02 * size, row + 0.022 * size)]), 0.01 * size, [TEXT])
    _plot(canvas, frame, Rect(0.11 * size, rect.top + 0.15 * size, 0.83 * size, rect.height - 0.205 * size))


def range_text(ranges: FloatArray, unit: str) -> str:
    """Return the common range or, if ranges differ, their mean and standard deviation."""
    if not len(ranges):
        return "range -"  # before the first action, or all agents have been caught
    words = f"{ranges[0]:.1f}" if np.ptp(ranges) == 0 else f"{ranges.mean():.1f} ± {ranges.std():.1f}"
    return f"range {words} {unit}"


def _plot(canvas: Canvas, frame: FlockFrame, plot: Rect) -> None:
    moments, means, minima, objectives = frame.series
    highest, size = means.max(), canvas.size
    horizon = frame.scenario.num_steps * frame.scenario.time_step
    step, tick = nice(highest / 2.6), nice(horizon / 8)
    top = step * np.ceil(highest / step)

    def at(times: ArrayLike, distances: ArrayLike) -> FloatArray:
        x = plot.left + plot.width * np.asarray(times) / horizon
        y = plot.bottom - plot.height * np.asarray(distances) / top
        return np.stack(np.broadcast_arrays(x, y), axis=-1)

    for level in np.arange(0.0, top + step / 2, step):
        line = at([0.0, horizon], level)
        canvas.segments(line[np.newaxis], [GRID if level else FRAME])
    for level in (0.0, top):
        x, y = at(0.0, level).tolist()
        canvas.text(f"{level:g}", (x - 0.012 * size, y), FAINT_TEXT, "midright")
    for time in np.arange(0.0, horizon + tick / 1e6, tick):
        x, y = at(time, 0.0).tolist()
        canvas.text(f"{time:g}", (x, y + 0.01 * size), FAINT_TEXT, "midtop")
    canvas.path(at(moments, minima), MINIMUM, 0.004 * size)
    canvas.path(at(moments, means), MEAN, 0.004 * size)
    if frame.spec.unit != "m":
        return
    level = at(moments, objectives)[np.argmin(objectives) :]
    canvas.path(level, TEXT, 0.002 * size)
    canvas.dots(level[:1], 0.008 * size, [TEXT])
