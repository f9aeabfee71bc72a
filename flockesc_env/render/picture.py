"""The picture of a flock or a line: agents in the color of their range, predators, rho and J.

Only this file imports pygame, which draws without a display and opens the window.
"""

import os
from collections.abc import Sequence
from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.common.extras import require
from flockesc_env.render.frames import FlockFrame, LineFrame, initial_region, listening
from flockesc_env.render.palette import LIGHT, Color, faded, range_colors, rgb

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a greeting on stdout
os.environ.setdefault("SDL_NO_SIGNAL_HANDLERS", "1")  # SDL would catch SIGTERM, also in forked workers
require("video", ["pygame"])
import pygame  # noqa: E402, after the check

Image = NDArray[np.uint8]

GRID, FRAME, TEXT, FAINT_TEXT = rgb(LIGHT.grid), rgb(LIGHT.frame), rgb(LIGHT.ink), rgb(LIGHT.muted)
PREDATOR = rgb(LIGHT.predator)

_LEFT, _RIGHT, _TOP, _BOTTOM = 0.03, 0.97, 0.15, 0.91
"""Edges of the part that shows the flock or the line, over the size of the picture; text is around it."""

_RIGHTWARD, _UPWARD = (0.883, 0.469, 0.0), (-0.191, 0.359, 0.914)
"""Directions in a space, seen from the side, that point right and up in the picture; unit vectors."""

_DART = np.array([(1.0, 0.0), (-0.8, 0.66), (-0.42, 0.0), (-0.8, -0.66)])
"""Corners of a mark (ahead, left) in units of its length ahead."""

_FIRST_STEPS = 10
"""Length of a line's time axis at the start; it grows with the episode."""

_PAPER = rgb(LIGHT.ground)
_FINE = 2
"""Oversampling per axis: each pixel is the mean of this many drawn ones, squared, which smooths edges."""

_CLOCK = pygame.time.Clock()


class Canvas:
    """A square picture of ``size`` px. Points and lengths are in px and can be fractions; y points down.

    ``colors`` have a row (red, green, blue) per polygon, line or circle.
    """

    def __init__(self, size: int) -> None:
        pygame.font.init()
        self.size = size
        self._fonts: dict[float, pygame.font.Font] = {}
        self._surface = pygame.Surface((_FINE * size, _FINE * size))
        self._surface.fill(_PAPER)

    def polygons(self, points: FloatArray, colors: ArrayLike) -> None:
        """Fill polygons, shape (k, corners, 2), with a rim in the color of the paper."""
        for corners, color in zip(_fine(points), np.asarray(colors).tolist(), strict=True):
            pygame.draw.polygon(self._surface, color, corners)
            pygame.draw.polygon(self._surface, _PAPER, corners, 1)

    def segments(self, points: FloatArray, colors: ArrayLike, width: float = 1.0) -> None:
        """Draw straight lines, shape (k, 2, 2)."""
        for (start, end), color in zip(_fine(points), np.asarray(colors).tolist(), strict=True):
            pygame.draw.line(self._surface, color, start, end, max(1, round(_FINE * width)))

    def discs(self, centers: FloatArray, radii: ArrayLike, colors: ArrayLike, rim: float = 0.0) -> None:
        """Fill circles, shapes (k, 2) and (k,); a ``rim`` above 0 draws only a rim of this width."""
        reach = np.broadcast_to(np.minimum(radii, 3 * self.size), len(centers))  # covers the picture
        circles = zip(_fine(centers), _fine(reach), np.asarray(colors).tolist(), strict=True)
        for center, radius, color in circles:
            pygame.draw.circle(self._surface, color, center, radius, round(_FINE * rim))

    def text(
        self, text: str, at: Sequence[float], color: Color, anchor: str = "topleft", height: float = 0.055
    ) -> float:
        """Write text with its ``anchor`` at a point, and return its width; ``height``: over the picture's."""
        if height not in self._fonts:  # pygame's own font, not kept longer: `pygame.quit` invalidates it
            self._fonts[height] = pygame.font.Font(None, round(_FINE * height * self.size))
        written = self._fonts[height].render(text, True, color)
        self._surface.blit(written, written.get_rect(**{anchor: _fine(at)}))
        return written.get_width() / _FINE

    def image(self) -> Image:
        """Return the picture, shape (size, size, 3)."""
        surface = pygame.transform.smoothscale(self._surface, (self.size, self.size))
        flat = np.frombuffer(pygame.image.tobytes(surface, "RGB"), np.uint8)
        return flat.reshape(self.size, self.size, 3).copy()


class Camera(NamedTuple):
    """Parallel projection to a picture."""

    matrix: FloatArray  # from m to px, shape (D, 2)
    offset: FloatArray  # pixel of the origin, shape (2,)
    scale: float  # px per m

    def pixels(self, points: FloatArray) -> FloatArray:
        """Return the pixels of points, shape (.., 2)."""
        pixels: FloatArray = points @ self.matrix + self.offset
        return pixels


def camera(view: FloatArray, size: int) -> Camera:
    """Return the camera that shows a box: the plane from above, y up; a space from the side, z up."""
    axes = np.eye(2) if view.shape[1] == 2 else np.stack([_RIGHTWARD, _UPWARD], axis=1)
    corners = _corners(view) @ axes
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = size * float(((_RIGHT - _LEFT, _BOTTOM - _TOP) / (high - low)).min())
    matrix = scale * axes * (1.0, -1.0)
    middle = size / 2 * np.array([_LEFT + _RIGHT, _TOP + _BOTTOM])
    return Camera(matrix, middle - view.mean(axis=0) @ matrix, scale)


def draw_frame(frame: FlockFrame | LineFrame, size: int, title: str = "") -> Image:
    """Return a picture, shape (size, size, 3). Equal frames give equal pictures."""
    canvas = Canvas(size)
    if isinstance(frame, LineFrame):
        _draw_line(canvas, frame, title)
    else:
        _draw_flock(canvas, frame, title)
    return canvas.image()


def _draw_flock(canvas: Canvas, frame: FlockFrame, title: str) -> None:
    size, unit = canvas.size, frame.scenario.range_unit
    eye, alive, known = camera(frame.view, size), ~frame.caught, frame.interaction_range
    ranges = np.broadcast_to(known if len(known) else 0.0, len(alive))[alive]
    places, predators = eye.pixels(frame.positions[alive]), eye.pixels(frame.predator_positions)
    red = np.tile(PREDATOR, (len(predators), 1))
    reach = frame.scenario.predator_range * eye.scale
    canvas.discs(predators, reach, faded(red, 0.88))
    canvas.discs(predators, reach, faded(red, 0.5), rim=1.0)
    _ground(canvas, eye, frame)
    for path in np.moveaxis(eye.pixels(frame.trail), 1, 0):
        pieces = np.stack([path[:-1], path[1:]], axis=1)
        age = np.linspace(1.0, 0.15, len(pieces))[:, np.newaxis]
        canvas.segments(pieces, faded(PREDATOR, age), 0.005 * size)
    length = 0.0125 * size * float(np.clip((300 / max(len(places), 1)) ** 0.25, 0.7, 1.5))
    colors = range_colors(ranges, frame.largest_range)
    canvas.polygons(_darts(eye, places, frame.velocities[alive], length), colors)
    canvas.polygons(_darts(eye, predators, frame.predator_velocities, 0.026 * size), red)
    if len(predators) == 1 and len(places) and frame.scenario.periodic_side is None:
        _rings(canvas, eye, frame, predators[0])

    # No words before the first action, or if all agents have been caught.
    words = listening(ranges, unit) if len(known) and len(ranges) else []
    time = frame.step * frame.scenario.time_step
    goal = frame.objective if len(predators) else "no predator"
    _write(canvas, title, f"{time:.1f} s", goal)
    x, y = _LEFT * size, 0.125 * size
    for text, rho in words:
        dot = range_colors(np.array([rho]), frame.largest_range)
        canvas.discs(np.array([(x + 0.01 * size, y)]), 0.01 * size, dot)
        x += 0.06 * size + canvas.text(text, (x + 0.03 * size, y), TEXT, "midleft", 0.045)
    if frame.caught.any():
        canvas.text(f"{frame.caught.sum()} caught", (0.5 * size, 0.96 * size), PREDATOR, "center")
    _color_scale(canvas, f"{frame.largest_range:g} {unit}")
    _ruler(canvas, eye.scale)


def _draw_line(canvas: Canvas, frame: LineFrame, title: str) -> None:
    steps, states, ranges = (np.array(column) for column in zip(*frame.history, strict=True))
    size, predator = canvas.size, frame.scenario.predator_position
    end = nice(max(_FIRST_STEPS, steps[-1]))
    low, high = min(0.0, float(states.min())), max(1.0, float(states.max()))

    def at(step: ArrayLike, state: ArrayLike) -> FloatArray:
        x = 0.1 + (_RIGHT - 0.1) * np.asarray(step) / end
        y = 0.86 - (0.86 - _TOP) * (np.asarray(state) - low) / (high - low)
        return size * np.stack(np.broadcast_arrays(x, y), axis=-1)

    if predator is not None:
        band = predator + frame.scenario.predator_range * np.array([-1, -1, 1, 1])
        corners = at([0, end, end, 0], np.clip(band, low, high))
        canvas.polygons(corners[np.newaxis], [faded(PREDATOR, 0.86)])
    for level in np.linspace(low, high, 6):
        canvas.segments(at([0, end], level)[np.newaxis], [GRID])
        canvas.text(f"{round(level, 2):g}", at(-0.012 * end, level).tolist(), FAINT_TEXT, "midright", 0.036)
    for step in np.linspace(0, end, 6):
        canvas.text(f"{step:g}", at(step, low - 0.02 * (high - low)).tolist(), FAINT_TEXT, "midtop", 0.036)
    canvas.text("steps", (0.535 * size, 0.96 * size), FAINT_TEXT, "center", 0.036)
    if predator is not None:
        canvas.segments(at([0, end], predator)[np.newaxis], [PREDATOR], 0.004 * size)
    colors = range_colors(ranges, frame.largest_range)
    for t in range(1, len(steps)):
        ends = np.stack([at(steps[k], states[k]) for k in (t - 1, t)], axis=1)
        # Agents with equal states stay together, so one line stands for all of them.
        _, kept = np.unique(np.round(ends.reshape(-1, 4), 1), axis=0, return_index=True)
        canvas.segments(ends[kept], np.tile(colors[t], (len(kept), 1)), 0.0025 * size)
    canvas.discs(at(steps[-1], states[-1]), 0.006 * size, np.tile(colors[-1], (len(states[-1]), 1)))
    goal = "" if predator is None else f"escape distance {np.abs(states[-1] - predator).min():.3f}"
    _write(canvas, title, f"t = {steps[-1]}, range {ranges[-1]:.3g}", goal or "no predator")
    _color_scale(canvas, f"{frame.largest_range:g}")


def nice(least: float) -> float:
    """Return the smallest of .., 0.2, 0.5, 1, 2, 5, 10, 20, .. that is at least ``least`` > 0."""
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(power * digit for digit in (1, 2, 5, 10) if power * digit >= least))


def _corners(view: FloatArray) -> FloatArray:
    """Return the corners of a box, shape (2^D, D)."""
    return np.array(list(product(*view.T)))


def _ground(canvas: Canvas, eye: Camera, frame: FlockFrame) -> None:
    """Draw the edges of the initial region, and dots where agents were caught."""
    corners = eye.pixels(_corners(initial_region(frame.scenario)))
    # Each axis is one bit of a corner's index, so the corners of an edge differ in one bit.
    edges = [pair for pair in combinations(range(len(corners)), 2) if (pair[0] ^ pair[1]).bit_count() == 1]
    canvas.segments(corners[edges], [FRAME] * len(edges))
    caught = eye.pixels(frame.positions[frame.caught])
    canvas.discs(caught, 0.005 * canvas.size, [FRAME] * len(caught))


def _darts(eye: Camera, centers: FloatArray, velocities: FloatArray, length: float) -> FloatArray:
    """Return the corners of marks that point along velocities, shape (k, 4, 2) in px."""
    pixels = velocities @ eye.matrix
    lengths = np.linalg.norm(pixels, axis=1, keepdims=True)
    ahead = np.where(lengths > 0, pixels / np.maximum(lengths, 1e-300), (1.0, 0.0))
    left = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
    offsets = _DART[:, :1] * ahead[:, np.newaxis] + _DART[:, 1:] * left[:, np.newaxis]
    corners: FloatArray = centers[:, np.newaxis] + length * offsets
    return corners


def _rings(canvas: Canvas, eye: Camera, frame: FlockFrame, center: FloatArray) -> None:
    """Draw the lowest mean distance so far as a ring with its number, and the present one as a hairline.

    The dotted ring is the lowest mean distance of the best fixed range.
    """
    size, color = canvas.size, rgb(frame.color)
    away = frame.positions[~frame.caught] - frame.predator_positions[0]
    now, lowest = float(np.linalg.norm(away, axis=1).mean()), frame.lowest
    canvas.discs(center[np.newaxis], eye.scale * now, faded([color], 0.5), rim=0.5)
    canvas.discs(center[np.newaxis], eye.scale * lowest, [color], rim=2.0)
    if np.isfinite(frame.rival):
        angles = np.linspace(0, 2 * np.pi, 90)[:, np.newaxis]
        dots = center + eye.scale * frame.rival * np.hstack([np.cos(angles), np.sin(angles)])
        canvas.discs(dots, 0.003 * size, [TEXT] * len(dots))
    # The number is at the first place on the ring that is in the picture.
    places = center + eye.scale * lowest * np.array([(0, 1), (1, 0), (0, -1), (-1, 0)])
    is_inside = ((places > 0.08 * size) & (places < 0.92 * size)).all(axis=1)
    at = places[int(is_inside.argmax())]
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (0.055 * size, 0.02 * size)
    canvas.polygons((at + corners)[np.newaxis], [_PAPER])
    canvas.text(f"{lowest:.0f} m", at, color, "center")


def _write(canvas: Canvas, title: str, time: str, goal: str) -> None:
    """Write the title, time and objective."""
    left, right, row = _LEFT * canvas.size, _RIGHT * canvas.size, 0.062 * canvas.size
    canvas.text(title, (left, 0.015 * canvas.size), TEXT)
    canvas.text(time, (left, row), TEXT)
    canvas.text(goal, (right, row), TEXT, "topright")


def _color_scale(canvas: Canvas, largest: str) -> None:
    """Draw the color scale of ranges into the lower left corner."""
    x, y, width = _LEFT * canvas.size, 0.96 * canvas.size, 0.006 * canvas.size
    x += canvas.text("0", (x, y), FAINT_TEXT, "midleft") + width
    for share in np.linspace(0.0, 1.0, 24):
        piece = np.array([[(x, y), (x + width, y)]])
        canvas.segments(piece, range_colors(np.array([share]), 1.0), 0.03 * canvas.size)
        x += width
    canvas.text(largest, (x + width, y), FAINT_TEXT, "midleft")


def _ruler(canvas: Canvas, scale: float) -> None:
    """Draw a length in m into the lower right corner."""
    length, right, y = nice(0.1 * canvas.size / scale), _RIGHT * canvas.size, 0.98 * canvas.size
    middle = right - length * scale / 2
    canvas.segments(np.array([[(2 * middle - right, y), (right, y)]]), [FAINT_TEXT], 0.004 * canvas.size)
    canvas.text(f"{length:g} m", (middle, y - 0.008 * canvas.size), FAINT_TEXT, "midbottom")


def show(image: Image, fps: int) -> None:
    """Show a picture in the window of this process, at most ``fps`` per second; the first one opens it."""
    height, width, _ = image.shape
    screen = pygame.display.get_surface()
    if screen is None or screen.get_size() != (width, height):
        pygame.display.init()
        screen = pygame.display.set_mode((width, height))
        pygame.display.set_caption("flockesc_env")
    screen.blit(pygame.image.frombuffer(image.tobytes(), (width, height), "RGB"), (0, 0))
    pygame.event.pump()
    _CLOCK.tick(fps)
    pygame.display.flip()


def close_window() -> None:
    """Close the window, if there is one."""
    pygame.display.quit()


def _fine(points: ArrayLike) -> Any:
    return (_FINE * np.asarray(points)).tolist()
