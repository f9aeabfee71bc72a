"""The colors of every picture: pygame's, the watch page's and the figures of Matplotlib.

Interaction ranges are viridis, learned policies purple, fixed ranges gray and predators vermilion.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Colors = NDArray[np.uint8]
"""Rows (red, green, blue)."""

Color = tuple[int, int, int]


@dataclass(frozen=True)
class Palette:
    """Colors as ``"#rrggbb"``, by their use."""

    page: str  # background of a page
    ground: str  # background of a flock
    line: str  # borders between parts
    frame: str  # axes, and crosses where agents were caught
    grid: str
    muted: str  # text of less weight
    ink: str
    accent: str  # controls, and a quantity that belongs to no policy
    predator: str
    alone: str  # an agent without neighbors
    fixed: str
    learned: str
    others: tuple[str, ...]  # other policies
    ranges: tuple[str, ...]  # from 0 to the largest in equal steps


LIGHT = Palette(
    page="#ffffff",
    ground="#fafaf8",
    line="#e2e2dd",
    frame="#bec1c6",
    grid="#ecece7",
    muted="#6b6f76",
    ink="#1d2129",
    accent="#0072b2",
    predator="#d55e00",
    alone="#949aa3",
    fixed="#3f4652",
    learned="#7c3aed",
    others=("#0d9488", "#0072b2", "#be185d", "#4d7c0f", "#b45309"),
    ranges=("#440154", "#3b528b", "#21918c", "#4fb95a", "#b7b71e"),
)

DARK = Palette(
    page="#15171b",
    ground="#1b1e23",
    line="#32363d",
    frame="#4a4f58",
    grid="#292d33",
    muted="#9aa0a9",
    ink="#e8eaed",
    accent="#56b4e9",
    predator="#ff7a1a",
    alone="#858c96",
    fixed="#c9ced6",
    learned="#a78bfa",
    others=("#66cc80", "#407080", "#f472b6", "#a3e635", "#f2f279"),
    ranges=("#8a63d8", "#4f8fd6", "#27b5a5", "#7ad95b", "#fde725"),
)


def rgb(color: str) -> Color:
    """Return a color ``"#rrggbb"`` as (red, green, blue)."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


def range_colors(ranges: NDArray[np.float64], largest: float) -> Colors:
    """Return a color per interaction range, shape (n, 3), on the palette's scale from 0 to ``largest``."""
    stops = np.array([rgb(color) for color in LIGHT.ranges])
    shares = np.clip(ranges / (largest or 1.0), 0.0, 1.0) * (len(stops) - 1)
    channels = [np.interp(shares, np.arange(len(stops)), channel) for channel in stops.T]
    return np.round(np.stack(channels, axis=-1)).astype(np.uint8)


def faded(colors: ArrayLike, amount: ArrayLike) -> Colors:
    """Return colors mixed with the ground's; ``amount`` from 0 to 1, a scalar or shape (k, 1)."""
    solid, ground = np.asarray(colors, np.float64), np.array(rgb(LIGHT.ground))
    mixed: Colors = np.round(solid + (ground - solid) * np.asarray(amount)).astype(np.uint8)
    return mixed
