"""Style of the studies' figures: letters of panels, colors of components, curves and forest plots."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import offset_copy
from numpy.typing import NDArray

from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.render.palette import LIGHT
from studies.measurements import sign
from training.figure_style import WIDTH

ROW = 0.235  # height of a row of a forest plot in inches

LABELS = (
    "#3073a5", "#ddb66a", "#934b63", "#7ed3a6", "#6b571f", "#cba553", "#55b8e2", "#6bc08e", "#b69be6",
    "#a1b564", "#88aaf1", "#40c1bd", "#d790c5", "#93892f", "#498cc4", "#1f9b82", "#a270b1", "#639654",
    "#7c7dc6", "#0097ab",
)  # fmt: skip
"""Colors of components, which repeat after 20. They are muted, so that no component looks like a predator."""


def subplots(height: float, *grid: int, **options: Any) -> tuple[Figure, Any]:
    """Return a figure of the common width and its axes; arguments are those of ``Figure.subplots``."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots(*grid, **options)


def letter(axes: Axes, index: int, title: str) -> None:
    """Title a panel as in the paper: (a), (b), .., and what it shows."""
    axes.set_title(f"({chr(ord('a') + index)}) {title}")


def component_colors(labels: NDArray[np.int64]) -> list[Any]:
    """Return a color per agent: the larger its component, the earlier in the palette; gray if alone."""
    _, places, sizes = np.unique(labels, return_inverse=True, return_counts=True)
    ranks = np.argsort(np.argsort(-sizes, kind="stable"))
    return [LIGHT.alone if sizes[k] == 1 else LABELS[ranks[k] % len(LABELS)] for k in places]


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
    low, high = [e.low for e in estimates], [e.high for e in estimates]
    axes.fill_between(at, low, high, color=color, alpha=band, lw=0)
    axes.plot(at, [e.mean for e in estimates], *form, color=color, **style)


def draw_forest(axes: Axes, groups: Mapping[str, Mapping[str, Estimate]]) -> None:
    """Draw estimates by title of their group and name, one per row: filled dots if intervals exclude 0.

    The mean stands at the right end of each row.
    """
    labels: list[str] = []
    color, across = LIGHT.fixed, axes.get_yaxis_transform()
    right = offset_copy(across, axes.get_figure(root=True), 4, units="points")
    for title, rows in groups.items():
        labels.append(title)
        for name, estimate in rows.items():
            place, face = len(labels), color if sign(estimate) else LIGHT.page
            axes.plot([estimate.low, estimate.high], [place, place], color=color, lw=2, solid_capstyle="butt")
            axes.plot(estimate.mean, place, "o", color=color, mfc=face, ms=5.5, zorder=3)
            axes.text(1.0, place, f"{estimate.mean:+z.1f}", va="center", transform=right)
            labels.append(name)
    axes.axvline(0, color=LIGHT.ink, lw=0.8, zorder=1)
    axes.set_yticks(range(len(labels)), labels)
    for tick, label in zip(axes.get_yticklabels(), labels, strict=True):
        tick.set_fontweight("bold" if label in groups else "normal")
    axes.set_ylim(len(labels) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x")
    axes.set_axisbelow(True)
    low, high = axes.get_xlim()
    axes.set_xlim(low, high + 0.02 * (high - low))
