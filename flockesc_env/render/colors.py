"""Colors as rows (red, green, blue) of uint8."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.models.simulate import IntArray

Colors = NDArray[np.uint8]
Color = tuple[int, int, int]

PAPER: Color = (252, 252, 250)
GRID: Color = (232, 233, 235)
FRAME: Color = (190, 193, 198)
TEXT: Color = (52, 58, 66)
FAINT_TEXT: Color = (128, 134, 142)
PREDATOR: Color = (200, 24, 40)
MEAN: Color = (38, 92, 168)
MINIMUM: Color = (214, 118, 20)
ALONE: Color = (158, 162, 168)

_LIGHTNESS, _CHROMA = (0.62, 0.53, 0.7), 0.155  # OKLCH
_FIRST_HUE, _HUES = 255.0, (55.0, 350.0)  # in degrees: blue first, and none of the predator's red


def component_colors(labels: IntArray) -> Colors:
    """Return a color per agent, shape (n, 3): that of its component's label, gray where it is alone."""
    colors = label_colors(len(labels))[labels]
    colors[np.bincount(labels, minlength=len(labels))[labels] == 1] = ALONE
    return colors


@cache
def label_colors(count: int) -> Colors:
    """Return the colors of the labels 0..count - 1, shape (count, 3); those of near labels lie far apart."""
    low, high = _HUES
    # Halving what is left of the hues again and again (van der Corput): 1/2, 1/4, 3/4, 1/8, ..
    share = np.array([int(f"{label:032b}"[::-1], 2) / 2**32 for label in range(count)])
    hue = np.deg2rad(low + (high - low) * (((_FIRST_HUE - low) / (high - low) + share) % 1.0))
    lightness = np.array(_LIGHTNESS)[np.arange(count) // 8 % len(_LIGHTNESS)]
    return _from_oklab(lightness, _CHROMA * np.cos(hue), _CHROMA * np.sin(hue))


def faded(colors: ArrayLike, amount: ArrayLike) -> Colors:
    """Return colors moved toward the paper by a share from 0 to 1, a scalar or shape (k, 1)."""
    solid = np.asarray(colors, np.float64)
    mixed: Colors = np.round(solid + (np.array(PAPER) - solid) * np.asarray(amount)).astype(np.uint8)
    return mixed


def _from_oklab(lightness: FloatArray, a: FloatArray, b: FloatArray) -> Colors:
    """Convert from OKLab, where equal steps look equal (B. Ottosson, 2020), to sRGB."""
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
