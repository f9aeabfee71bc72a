"""Style of the studies' figures: letters of panels, colors of components."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.render.palette import LABELS, LIGHT


def letter(axes: Axes, index: int, title: str = "") -> None:
    """Title a panel as in the paper: (a), (b), .., and what it shows."""
    axes.set_title(f"({chr(ord('a') + index)}) {title}".rstrip())


def component_colors(labels: NDArray[np.int64]) -> list[Any]:
    """Return a color per agent: the larger its component, the earlier in the palette; gray if alone."""
    names, sizes = np.unique(labels, return_counts=True)
    order = np.argsort(-sizes, kind="stable")
    color = {
        int(names[index]): LABELS[rank % len(LABELS)] if sizes[index] > 1 else LIGHT.alone
        for rank, index in enumerate(order)
    }
    return [color[int(label)] for label in labels]


def cluster_colors(final: FloatArray, rho: float) -> list[Any]:
    """Return a color per agent of a line: that of its cluster, counted from below."""
    order = np.argsort(final, kind="stable")
    numbers = np.zeros(len(final), int)
    numbers[order] = np.concatenate([[0], np.cumsum(np.diff(final[order]) > rho)])
    return [LABELS[number % len(LABELS)] for number in numbers]


def caption(figure: Figure, text: str, size: float = 10) -> None:
    """Write a line above all panels."""
    figure.suptitle(text, x=0.01, ha="left", fontsize=size)


def curve(
    axes: Axes,
    at: Sequence[float],
    estimates: Sequence[Estimate],
    color: str,
    *form: str,
    band: float,
    **style: Any,
) -> None:
    """Draw estimates as a line with a band of their intervals; ``band`` is its opacity."""
    axes.fill_between(
        at, [e.low for e in estimates], [e.high for e in estimates], color=color, alpha=band, lw=0
    )
    axes.plot(at, [e.mean for e in estimates], *form, color=color, **style)
