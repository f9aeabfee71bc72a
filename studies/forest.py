"""Forest plots: estimates with their intervals, one per row, rows in titled groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes

from flockesc_env.common.stats import Estimate
from flockesc_env.render.palette import LIGHT

ROW = 0.235
"""Height of a row in inches."""


@dataclass(frozen=True)
class Group:
    """Rows under a title."""

    title: str
    rows: Sequence[tuple[str, Estimate]]
    color: str = ""


def num_lines(groups: Sequence[Group]) -> int:
    """Return the number of lines that the groups take, their titles included."""
    return sum(len(group.rows) + bool(group.title) for group in groups)


def draw_forest(axes: Axes, groups: Sequence[Group], color: str, digits: int = 1) -> None:
    """Draw the estimates: a filled dot if the interval excludes 0, otherwise a hollow one.

    The mean stands at the right end of each row.
    """
    labels: list[tuple[str, bool]] = []
    for group in groups:
        if group.title:
            labels.append((group.title, True))
        for name, estimate in group.rows:
            _row(axes, len(labels), estimate, group.color or color, digits)
            labels.append((name, False))
    axes.axvline(0, color=LIGHT.ink, lw=0.8, zorder=1)
    axes.set_yticks(range(len(labels)), [text for text, _ in labels])
    for tick, (_, is_title) in zip(axes.get_yticklabels(), labels, strict=True):
        tick.set_fontweight("bold" if is_title else "normal")
    axes.set_ylim(len(labels) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x")
    axes.set_axisbelow(True)
    low, high = axes.get_xlim()
    axes.set_xlim(low, high + 0.02 * (high - low))


def _row(axes: Axes, place: int, estimate: Estimate, color: str, digits: int) -> None:
    excludes_zero = estimate.low > 0 or estimate.high < 0
    axes.plot([estimate.low, estimate.high], [place, place], color=color, lw=2, solid_capstyle="butt")
    face = color if excludes_zero else LIGHT.page
    axes.plot(estimate.mean, place, "o", color=color, mfc=face, ms=5.5, zorder=3)
    axes.annotate(
        f"{round(estimate.mean, digits) + 0.0:+.{digits}f}",  # no negative zero
        (1.0, place),
        xytext=(4, 0),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        va="center",
        annotation_clip=False,
    )
