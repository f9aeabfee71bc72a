"""The colors of every picture: pygame's, the watch page's and the figures of Matplotlib.

Interaction ranges are viridis, learned policies purple, fixed ranges gray and predators vermilion. Components
are muted, so that no component looks like a predator. The colors of the five largest components are as easy
to tell apart with any kind of color blindness as those of Okabe and Ito.
"""

from __future__ import annotations

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
    components: tuple[str, ...]  # the largest components
    other: str  # a smaller component
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
    components=("#3073a5", "#ddb66a", "#934b63", "#7ed3a6", "#6b571f"),
    other="#4b5058",
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
    components=("#97b8fc", "#ffd791", "#e399c7", "#b3be8d", "#a1ebf7"),
    other="#b9bec6",
    alone="#858c96",
    fixed="#c9ced6",
    learned="#a78bfa",
    others=("#66cc80", "#407080", "#f472b6", "#a3e635", "#f2f279"),
    ranges=("#8a63d8", "#4f8fd6", "#27b5a5", "#7ad95b", "#fde725"),
)

LABELS = (
    *LIGHT.components,
    *("#cba553", "#55b8e2", "#6bc08e", "#b69be6", "#a1b564", "#88aaf1", "#40c1bd", "#d790c5"),
    *("#93892f", "#498cc4", "#1f9b82", "#a270b1", "#639654", "#7c7dc6", "#0097ab"),
)
"""Colors of the labels of components, which repeat after 20."""


def rgb(color: str) -> Color:
    """Return a color ``"#rrggbb"`` as (red, green, blue)."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


def component_colors(labels: NDArray[np.int64]) -> Colors:
    """Return a color per agent, shape (n, 3): the color of its component's label, gray if it is alone."""
    colors = np.array([rgb(color) for color in LABELS], np.uint8)[labels % len(LABELS)]
    colors[np.bincount(labels, minlength=len(labels))[labels] == 1] = rgb(LIGHT.alone)
    return colors


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
