"""Style of the studies' figures: letters of panels, colors of components."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from flockesc_env.common.stats import FloatArray
from flockesc_env.render.colors import label_colors
from flockesc_env.render.palette import LIGHT

_PALETTE: list[Any] = (label_colors(20) / 255).tolist()


def letter(axes: Axes, index: int, title: str = "") -> None:
    """Title a panel as in the paper: (a), (b), .., and what it shows."""
    axes.set_title(f"({chr(ord('a') + index)}) {title}".rstrip())


def component_colors(labels: NDArray[np.int64]) -> list[Any]:
    """Return a color per agent: the larger its component, the earlier in the palette; gray if alone."""
    names, sizes = np.unique(labels, return_counts=True)
    order = np.argsort(-sizes, kind="stable")
    color = {
        int(names[index]): _PALETTE[rank % len(_PALETTE)] if sizes[index] > 1 else LIGHT.alone
        for rank, index in enumerate(order)
    }
    return [color[int(label)] for label in labels]


def cluster_colors(final: FloatArray, rho: float) -> list[Any]:
    """Return a color per agent of a line: that of its cluster, counted from below."""
    order = np.argsort(final, kind="stable")
    numbers = np.zeros(len(final), int)
    numbers[order] = np.concatenate([[0], np.cumsum(np.diff(final[order]) > rho)])
    return [_PALETTE[number % len(_PALETTE)] for number in numbers]
