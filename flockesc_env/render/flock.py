"""The picture of a flock: agents in the color of component or range, predators, and the distances so far."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flockesc_env.common.checks import FloatArray
from flockesc_env.models.graph import component_labels, neighbor_pairs
from flockesc_env.models.simulate import IntArray
from flockesc_env.render.camera import VIEW_ASPECT, Camera, Rect, camera
from flockesc_env.render.canvas import Canvas, Image
from flockesc_env.render.colors import (
    FAINT_TEXT,
    FRAME,
    PREDATOR,
    TEXT,
    Colors,
    component_colors,
    faded,
    range_colors,
)
from flockesc_env.render.frame import FlockFrame, FlockMoment
from flockesc_env.render.ground import draw_ground
from flockesc_env.render.options import RenderOptions
from flockesc_env.render.strip import draw_strip

_DART = np.array([(1.0, 0.0), (-0.8, 0.66), (-0.42, 0.0), (-0.8, -0.66)])
"""Corners of a mark (ahead, left) in units of its length ahead."""

_HAZE = 0.55
"""Share of the paper in the color of the farthest agent in space."""


def draw_flock(frame: FlockFrame, options: RenderOptions, title: str = "") -> Image:
    """Return the picture of a frame, shape (size, size, 3). Equal frames give equal pictures."""
    size = options.size
    canvas, rect = Canvas(size), Rect(0, 0, size, size / VIEW_ASPECT)
    eye = camera(frame.view, rect)
    chosen = _chosen(frame, options)
    lost, frame = frame.moment.positions[frame.moment.caught], _survivors(frame)
    labels = np.empty(0, np.int64)
    if len(frame.moment.positions):
        labels = component_labels(frame.scenario, *_listening(frame), velocities=frame.listening.velocities)
    colors = component_colors(labels)
    ranges = frame.moment.ranges
    largest = ranges.max(initial=0.0) if options.largest_range is None else options.largest_range
    if options.color == "range":
        colors = range_colors(ranges, largest)
    canvas.clip(rect)
    draw_ground(canvas, eye, frame.view, rect)
    if frame.view.shape[1] == 3:
        _shadows(canvas, eye, frame)
    _predator_ranges(canvas, eye, frame)
    _crosses(canvas, eye, lost)
    if options.show == "discs" and frame.scenario.neighbor_rule.unit == "m":
        _interaction_discs(canvas, eye, frame, chosen, colors)
    elif options.show != "none":
        _edges(canvas, eye, frame, chosen, colors)
    _trails(canvas, eye, frame, options)
    _marks(canvas, eye, frame, colors)
    canvas.clip(None)
    canvas.text(title, (0.022 * size, 0.02 * size), TEXT)
    if options.color == "range":
        _scale(canvas, rect, largest, frame.scenario.neighbor_rule.unit)
    else:
        _count(canvas, rect, len(np.unique(labels)))
    draw_strip(canvas, frame, Rect(0, rect.bottom, size, size - rect.bottom))
    return canvas.image()


def _scale(canvas: Canvas, rect: Rect, largest: float, unit: str) -> None:
    """Draw the color scale of ranges into the lower left corner."""
    size, steps = canvas.size, 32
    width, height, gap = 0.12 * size, 0.034 * size, 0.012 * size
    left, middle = 0.022 * size, rect.bottom - 0.04 * size
    left += canvas.text("range 0", (left, middle), FAINT_TEXT, "midleft") + gap
    for step, color in enumerate(range_colors(np.linspace(0.0, 1.0, steps), 1.0).tolist()):
        part = Rect(left + width * step / steps, middle - height / 2, width / steps + 1, height)
        canvas.fill(part, tuple(color))
    canvas.text(f"{largest:g} {unit}", (left + width + gap, middle), FAINT_TEXT, "midleft")


def _count(canvas: Canvas, rect: Rect, num_components: int) -> None:
    """Write the number of components into the lower left corner."""
    words = f"{num_components} component{'' if num_components == 1 else 's'}"
    canvas.text(words, (0.022 * canvas.size, rect.bottom - 0.04 * canvas.size), FAINT_TEXT, "midleft")


def _chosen(frame: FlockFrame, options: RenderOptions) -> IntArray:
    """Return the agents whose discs or edges are drawn, as indices into the agents of `_survivors`."""
    caught = frame.moment.caught
    return np.flatnonzero(np.isin(np.flatnonzero(~caught), options.selected(len(caught))))


def _survivors(frame: FlockFrame) -> FlockFrame:
    """Return the frame without the agents that have been caught."""
    alive = ~frame.moment.caught

    def left(moment: FlockMoment) -> FlockMoment:
        ranges = moment.interaction_range
        return replace(
            moment,
            positions=moment.positions[alive],
            velocities=moment.velocities[alive],
            interaction_range=ranges if len(ranges) < len(alive) else ranges[alive],
        )

    return replace(frame, moment=left(frame.moment), listening=left(frame.listening))


def _crosses(canvas: Canvas, eye: Camera, places: FloatArray) -> None:
    """Draw a cross where each agent was caught."""
    centers, _ = eye(places)
    arm = 0.005 * canvas.size * np.array([[(-1.0, -1.0), (1.0, 1.0)], [(-1.0, 1.0), (1.0, -1.0)]])
    strokes = (centers[:, np.newaxis, np.newaxis] + arm).reshape(-1, 2, 2)
    canvas.segments(strokes, [FRAME] * len(strokes), 0.0025 * canvas.size)


def _shadows(canvas: Canvas, eye: Camera, frame: FlockFrame) -> None:
    """Draw the shadows of agents and predators on the floor, and a line from each predator down to it."""
    moment, floor = frame.moment, frame.view[0, 2]
    agents, _ = eye(moment.positions * (1, 1, 0) + (0, 0, floor))
    canvas.dots(agents, 0.0022 * canvas.size, [FRAME] * len(agents))
    feet, _ = eye(moment.predator_positions * (1, 1, 0) + (0, 0, floor))
    predators, _ = eye(moment.predator_positions)
    faint = faded([PREDATOR] * len(feet), 0.6).tolist()
    canvas.segments(np.stack([feet, predators], axis=1), faint)
    canvas.dots(feet, 0.005 * canvas.size, faint)


def _predator_ranges(canvas: Canvas, eye: Camera, frame: FlockFrame) -> None:
    centers, scale = eye(frame.moment.predator_positions)
    radii = frame.scenario.predator_range * scale
    canvas.discs(centers, radii, np.tile(np.array(PREDATOR, np.uint8), (len(centers), 1)), 0.1)
    for center, radius in zip(centers, radii.tolist(), strict=True):
        canvas.ring(center, radius, tuple(faded(PREDATOR, 0.62).tolist()))


def _interaction_discs(
    canvas: Canvas, eye: Camera, frame: FlockFrame, chosen: IntArray, colors: Colors
) -> None:
    """Draw the interaction ranges of the last step as discs: an agent's neighbors are inside its disc."""
    centers, scale = eye(frame.moment.positions[chosen])
    far_first = np.argsort(scale, kind="stable")
    radii = (frame.moment.ranges[chosen] * scale)[far_first]
    canvas.discs(centers[far_first], radii, colors[chosen][far_first], 0.16)


def _edges(canvas: Canvas, eye: Camera, frame: FlockFrame, chosen: IntArray, colors: Colors) -> None:
    """Draw a line between two agents if at least one of them was a neighbor of the other in the last step."""
    if not len(chosen):
        return
    count = len(frame.moment.positions)
    pairs = neighbor_pairs(frame.scenario, *_listening(frame), velocities=frame.listening.velocities)
    is_chosen = np.isin(np.arange(count), chosen)
    pairs = np.sort(pairs[is_chosen[pairs].any(axis=1)], axis=1)
    ones, others = np.divmod(np.unique(pairs[:, 0] * count + pairs[:, 1]), count)  # every pair once
    pixels, _ = eye(frame.moment.positions)
    ends = np.stack([pixels[ones], pixels[others]], axis=1)
    canvas.segments(ends, faded(colors, 0.55)[ones].tolist())


def _listening(frame: FlockFrame) -> tuple[FloatArray, FloatArray]:
    """Return the positions and ranges that define the neighbor graph."""
    return frame.listening.positions, frame.listening.ranges


def _trails(canvas: Canvas, eye: Camera, frame: FlockFrame, options: RenderOptions) -> None:
    """Draw the past positions of the predators, fading with age."""
    times = frame.series[0]
    recent = times >= times[-1] - options.trail
    for predator in range(frame.trails.shape[1]):
        points, _ = eye(frame.trails[recent, predator])
        pieces = np.stack([points[:-1], points[1:]], axis=1)
        age = np.linspace(1.0, 0.15, len(pieces))[:, np.newaxis]
        fading = faded(np.tile(PREDATOR, (len(pieces), 1)), age).tolist()
        canvas.segments(pieces, fading, 0.005 * canvas.size)


def _marks(canvas: Canvas, eye: Camera, frame: FlockFrame, colors: Colors) -> None:
    """Draw agents and predators as darts along their velocities; in space distant ones are small and pale."""
    moment = frame.moment
    count, predators = len(moment.positions), len(moment.predator_positions)
    points = np.concatenate([moment.positions, moment.predator_positions])
    velocities = np.concatenate([moment.velocities, moment.predator_velocities])
    _, scale = eye(points)
    crowding = np.clip((300 / max(count, 1)) ** 0.25, 0.7, 1.5)
    lengths = canvas.size * np.repeat([0.0125 * crowding, 0.026], [count, predators])
    near, far = scale.max(), scale.min()
    depth = (near - scale) / (near - far) if near > far else np.zeros_like(scale)
    shades = np.concatenate([colors, np.tile(np.array(PREDATOR, np.uint8), (predators, 1))])
    shades = np.concatenate([faded(shades, _HAZE * depth[:, np.newaxis])[:count], shades[count:]])
    order = np.argsort(scale, kind="stable")
    corners = _darts(eye, points, velocities, lengths * scale / scale.mean())
    canvas.polygons(corners[order], shades[order].tolist())


def _darts(eye: Camera, points: FloatArray, velocities: FloatArray, lengths: FloatArray) -> FloatArray:
    """Return the corners of marks, shape (k, 4, 2) in px, foreshortened in the direction of the view."""
    ahead = velocities / np.maximum(np.linalg.norm(velocities, axis=1, keepdims=True), 1e-300)
    centers, scale = eye(points)
    short = 1e-3  # m; a step for the derivative of the projection
    seen = (eye(points + short * ahead)[0] - centers) / (short * scale[:, np.newaxis])
    share = np.linalg.norm(seen, axis=1, keepdims=True)
    along = np.where(share > 1e-6, seen / np.maximum(share, 1e-6), (1.0, 0.0))
    left = np.stack([along[:, 1], -along[:, 0]], axis=1)
    along *= np.clip(0.4 + 0.6 * share, 0.4, 1.0)
    offsets = _DART[:, :1, np.newaxis] * along + _DART[:, 1:, np.newaxis] * left
    corners: FloatArray = centers[:, np.newaxis] + lengths[:, np.newaxis, np.newaxis] * offsets.transpose(
        1, 0, 2
    )
    return corners
