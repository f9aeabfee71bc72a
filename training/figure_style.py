"""Matplotlib settings and helpers of all figures: sizes, colors of the palette, labels instead of legends."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.transforms import offset_copy

from flockesc_env.common.files import atomic_write
from flockesc_env.common.stats import FloatArray
from flockesc_env.render.palette import LIGHT

WIDTH = 8.3
"""Width of a figure in inches: a README shows it at about 100 px per inch, where 9 pt are 12 px."""

DPI = 150
RANGES = LinearSegmentedColormap.from_list("ranges", LIGHT.ranges)
_LEADER = {"arrowstyle": "-", "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "relpos": (0, 0.5)}
BAND = "0.88"
"""Gray of the interval around a curve."""

mpl.rcdefaults()  # instead of the user's matplotlibrc
mpl.rc("font", size=9)
mpl.rc("figure", titlesize=11)
mpl.rc("text", color=LIGHT.ink)
mpl.rc("axes", titlesize=10, titlelocation="left", titlecolor=LIGHT.ink)
mpl.rc("axes", labelsize=9, labelcolor=LIGHT.ink, edgecolor=LIGHT.muted)
mpl.rc("axes.spines", top=False, right=False)
mpl.rc("xtick", labelsize=9, labelcolor=LIGHT.ink, color=LIGHT.muted)
mpl.rc("ytick", labelsize=9, labelcolor=LIGHT.ink, color=LIGHT.muted)
mpl.rc("legend", frameon=False)
mpl.rc("grid", color=LIGHT.grid)


def label_ends(axes: Axes, labels: Sequence[tuple[float, str, str]], gap: float = 0.075) -> None:
    """Write labels right of the axes at the heights of the curves' ends, moved apart where they overlap.

    Thin lines lead from moved labels.

    Args:
        axes: the panel, with its final limits.
        labels: height in data coordinates, text and color of each label.
        gap: least distance between labels, as a share of the height of the panel.
    """
    last = float(axes.get_xlim()[1])
    axes.get_ylim()  # computes limits that are still to be computed
    to_axes = axes.transScale + axes.transLimits
    ordered = sorted(labels, key=lambda label: label[0])
    heights = [float(to_axes.transform((last, height))[1]) for height, _, _ in ordered]
    places = [*heights]
    for _ in range(200):
        for below in range(len(places) - 1):
            overlap = max(gap - (places[below + 1] - places[below]), 0.0)
            places[below] -= overlap / 2
            places[below + 1] += overlap / 2
    for place, height, (_, text, color) in zip(places, heights, ordered, strict=True):
        has_moved = abs(place - height) > 0.2 * gap
        away = 5 + 12 * has_moved
        axes.annotate(
            text,
            (1.0, height),
            xytext=(1.0, place),
            xycoords="axes fraction",
            textcoords=offset_copy(axes.transAxes, axes.get_figure(root=True), away, units="points"),
            color=color,
            va="center",
            arrowprops={**_LEADER, "color": color} if has_moved else None,
            annotation_clip=False,
        )


def draw_predator(axes: Axes, path: FloatArray, reach: float) -> None:
    """Draw the path of a predator, shape (times, 2), and the disc around its end within which agents flee."""
    here = (path[-1, 0], path[-1, 1])
    axes.plot(*path.T, color=LIGHT.predator, lw=1)
    axes.plot(*here, "o", color=LIGHT.predator, ms=4)
    axes.add_patch(Circle(here, reach, color=LIGHT.predator, alpha=0.15, lw=0))


def save_figure(figure: Figure, file: Path) -> Path:
    """Write a figure as PNG and return the file. Equal figures give equal bytes."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(file) as opened:
        figure.savefig(opened, format="png", dpi=DPI, metadata={"Software": None})
    return file
