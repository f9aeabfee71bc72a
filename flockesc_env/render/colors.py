"""The colors of pygame's pictures, as rows (red, green, blue) of uint8."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.models.simulate import IntArray
from flockesc_env.render.palette import LIGHT

Colors = NDArray[np.uint8]
Color = tuple[int, int, int]


def rgb(color: str) -> Color:
    """Return a color ``"#rrggbb"`` as (red, green, blue)."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


PAPER = rgb(LIGHT.ground)
GRID = rgb(LIGHT.grid)
FRAME = rgb(LIGHT.frame)
TEXT = rgb(LIGHT.ink)
FAINT_TEXT = rgb(LIGHT.muted)
PREDATOR = rgb(LIGHT.predator)
MEAN = rgb(LIGHT.accent)
MINIMUM = rgb(LIGHT.others[0])
ALONE = rgb(LIGHT.alone)

_LIGHTNESS, _CHROMA = (0.74, 0.62, 0.5), 0.11  # OKLCH
_HUES = (85.0, 372.0)  # degrees; vermilion is at 48


def component_colors(labels: IntArray) -> Colors:
    """Return a color per agent, shape (n, 3): the color of its component's label, gray if it is alone."""
    colors = label_colors(len(labels))[labels]
    colors[np.bincount(labels, minlength=len(labels))[labels] == 1] = ALONE
    return colors


def range_colors(ranges: FloatArray, largest: float) -> Colors:
    """Return a color per interaction range, shape (n, 3), on the palette's scale from 0 to ``largest``."""
    stops = np.array([rgb(color) for color in LIGHT.ranges], np.float64)
    shares = np.clip(ranges / (largest or 1.0), 0.0, 1.0) * (len(stops) - 1)
    channels = [np.interp(shares, np.arange(len(stops)), channel) for channel in stops.T]
    colors: Colors = np.round(np.stack(channels, axis=-1)).astype(np.uint8)
    return colors


@cache
def label_colors(count: int) -> Colors:
    """Return the colors of the labels 0..count - 1, shape (count, 3): the palette's, then muted hues."""
    named = np.array([rgb(color) for color in LIGHT.components], np.uint8)
    more = np.arange(max(count - len(named), 0))
    # The van der Corput sequence halves the gaps between hues: 0, 1/2, 1/4, 3/4, 1/8, ..
    share = np.array([int(f"{index:032b}"[::-1], 2) / 2**32 for index in more])
    hue = np.deg2rad(_HUES[0] + (_HUES[1] - _HUES[0]) * share)
    lightness = np.array(_LIGHTNESS)[more // 8 % len(_LIGHTNESS)]
    return np.concatenate([named, _from_oklab(lightness, _CHROMA * np.cos(hue), _CHROMA * np.sin(hue))])[
        :count
    ]


def faded(colors: ArrayLike, amount: ArrayLike) -> Colors:
    """Return colors mixed with the paper's; ``amount`` from 0 to 1, a scalar or shape (k, 1)."""
    solid = np.asarray(colors, np.float64)
    mixed: Colors = np.round(solid + (np.array(PAPER) - solid) * np.asarray(amount)).astype(np.uint8)
    return mixed


def _from_oklab(lightness: FloatArray, a: FloatArray, b: FloatArray) -> Colors:
    """Convert from OKLab, a perceptually uniform color space (B. Ottosson, 2020), to sRGB."""
    to_cones = np.array(
        [[0.3963377774, 0.2158037573], [-0.1055613458, -0.0638541728], [-0.0894841775, -1.2914855480]]
    )
    to_linear = np.array(
        [
            [4.0767416621, -3.3077115913, 0.2309699292],
            [-1.2684380046, 2.6097574011, -0.3413193965],
            [-0.0041960863, -0.7034186147, 1.7076147010],
        ]
    )
    cones = lightness[:, np.newaxis] + np.stack([a, b], axis=1) @ to_cones.T
    linear = np.clip(cones**3 @ to_linear.T, 0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    colors: Colors = np.round(255 * encoded).astype(np.uint8)
    return colors
