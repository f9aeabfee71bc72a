"""The strip below a flock: time, range, components, J, and the predator distances so far."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flockesc_env.common.checks import FloatArray
from flockesc_env.render.camera import Rect
from flockesc_env.render.canvas import Canvas
from flockesc_env.render.colors import FAINT_TEXT, FRAME, GRID, MEAN, MINIMUM, PREDATOR, TEXT
from flockesc_env.render.frame import FlockFrame
from flockesc_env.render.ground import nice


def draw_strip(canvas: Canvas, frame: FlockFrame, rect: Rect, *, num_components: int) -> None:
    """Draw the text, and the mean and minimum distance over the time of the episode."""
    size, moment = canvas.size, frame.moment
    canvas.fill(Rect(rect.left, rect.top, rect.width, max(1.0, 0.002 * size)), FRAME)
    one = "" if num_components == 1 else "s"
    words = [
        f"t = {frame.series[0, -1]:.2f} s",
        f"range {range_text(moment.interaction_range)} {frame.scenario.neighbor_rule.unit}",
        f"{num_components} component{one}",
        f"J = {frame.spec.text(moment.objective)}" if np.isfinite(moment.objective) else "no predator",
    ]
    row = rect.top + 0.017 * size
    for word, at in zip(words, (0.022, 0.2, 0.5, 0.8), strict=True):
        canvas.text(word, (at * size, row), round(0.04 * size), TEXT)
    row += 0.052 * size
    small = round(0.034 * size)
    is_length = frame.spec.unit == "m"  # then J has the axis of the distances
    rest = "lowest so far:" if is_length else f"J: {frame.spec.label}"
    legend = [
        ("mean", MEAN),
        ("and", FAINT_TEXT),
        ("minimum", MINIMUM),
        (f"predator distance (m), {rest}", FAINT_TEXT),
    ]
    at = 0.022 * size
    for word, color in legend:
        at += canvas.text(word, (at, row), small, color) + 0.012 * size
    if moment.caught.any():
        canvas.text(f"{moment.caught.sum()} caught", (0.97 * size, row), small, PREDATOR, "topright")
    if is_length:
        canvas.dots(np.array([(at + 0.006 * size, row + 0.3 * small)]), 0.008 * size, [TEXT])
    _plot(
        canvas, frame, Rect(0.085 * size, rect.top + 0.125 * size, 0.885 * size, rect.height - 0.172 * size)
    )


def range_text(ranges: FloatArray) -> str:
    """Return the common range or, if ranges differ, their mean and standard deviation."""
    if not len(ranges):
        return "-"  # all agents have been caught
    return f"{ranges[0]:.1f}" if np.ptp(ranges) == 0 else f"{ranges.mean():.1f} ± {ranges.std():.1f}"


def _plot(canvas: Canvas, frame: FlockFrame, plot: Rect) -> None:
    moments, means, minima, objectives = frame.series
    highest = means.max()
    if not np.isfinite(highest):
        return  # without predators
    size, small = canvas.size, round(0.032 * canvas.size)
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
        canvas.text(f"{level:g}", (plot.left - 0.012 * size, line[0, 1]), small, FAINT_TEXT, "midright")
    for time in np.arange(0.0, horizon + tick / 1e6, tick):
        x, y = at(time, 0.0).tolist()
        canvas.text(f"{time:g}", (x, y + 0.01 * size), small, FAINT_TEXT, "midtop")
    canvas.path(at(moments, minima), MINIMUM, 0.004 * size)
    canvas.path(at(moments, means), MEAN, 0.004 * size)
    if frame.spec.unit != "m":
        return
    level = at(moments, objectives)[np.argmin(objectives) :]
    canvas.path(level, TEXT, 0.002 * size)
    canvas.dots(level[:1], 0.008 * size, [TEXT])
