"""Figures of the page: learning curves, gains, performance profiles, what matters, transfer."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib as mpl
import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from flockesc_env.common.files import atomic_write
from flockesc_env.common.stats import Estimate, FloatArray
from studies.learned.aggregate import Profile
from studies.learned.results import BEST_FIXED, Study
from studies.learned.summary import Summary
from studies.style import INK

Row = tuple[str, Estimate]
"""A label and what is drawn beside it."""

_DPI = 150
_FLAT = "0.5"
_COLORS = [
    color
    for palette in (mpl.color_sequences["tab20"][::2], mpl.color_sequences["tab20"][1::2])
    for place, color in enumerate(palette)
    if place != 7  # the grays
]
_UP, _DOWN = "tab:blue", "tab:red"


def learning_curves(studies: Sequence[Study]) -> Figure:
    """Draw the objective on tuning flocks against episodes: median and range over training seeds."""
    figure, panels = _panels(len(studies))
    colors = _colors(studies)
    for axes, study in zip(panels, studies, strict=True):
        for name in study.trained:
            color, value = colors[name], pl.col("objective")
            points = study.curves.filter(learner=name).group_by("episodes")
            table = points.agg(
                value.median().alias("median"), value.min().alias("low"), value.max().alias("high")
            )
            episodes, median, low, high = table.sort("episodes").to_numpy().T
            axes.fill_between(episodes, low, high, color=color, alpha=0.2, lw=0)
            axes.plot(episodes, median, color=color, lw=1.5, label=name)
        level = float(study.values(BEST_FIXED).mean())
        axes.axhline(level, color=_FLAT, ls="--", lw=1, label=BEST_FIXED)
        axes.set_xscale("log")
        axes.xaxis.set_minor_formatter(NullFormatter())  # its labels overlap
        axes.set_xlabel("training episodes")
        axes.set_ylabel(_label(study))
        _title_and_legend(axes, study)
    return figure


def gains(summaries: Sequence[Summary]) -> Figure:
    """Draw the paired gain of every learner, a panel per objective and one for the line, without unit."""
    panels: dict[str, list[Row]] = {}
    for kind in ("mean distance", "minimum distance", "line"):
        rows = [
            (f"{summary.study.setting}: {learner}", summary.policies[learner].difference)
            for summary in summaries
            if _kind(summary.study) == kind
            for learner in summary.study.trained
        ]
        if rows:
            panels[f"{kind}: gain over the best fixed range{'' if kind == 'line' else ' (m)'}"] = rows
    return dots_and_bars(panels)


def performance_profiles(studies: Sequence[Study], profiles: dict[str, dict[str, Profile]]) -> Figure:
    """Draw the share of episodes above every value of the objective, with 95 % bands."""
    figure, panels = _panels(len(studies))
    colors = _colors(studies)
    for axes, study in zip(panels, studies, strict=True):
        values = thresholds(study)
        for name, profile in profiles[study.setting].items():
            color = colors[name]
            axes.fill_between(values, profile.low, profile.high, color=color, alpha=0.2, lw=0)
            style = "--" if name == BEST_FIXED else "-"
            axes.plot(values, profile.share, style, color=color, lw=1.5, label=name)
        axes.set_xlabel(_label(study))
        axes.set_ylabel("share of episodes above")
        _title_and_legend(axes, study)
    return figure


def thresholds(study: Study) -> FloatArray:
    """Return where performance profiles are taken: most of what any policy reaches, shape (61,)."""
    low, high = study.episodes["objective"].quantile(0.005), study.episodes["objective"].quantile(0.995)
    return np.linspace(low or 0.0, high or 0.0, 61)


def dots_and_bars(panels: dict[str, list[Row]]) -> Figure:
    """Draw estimates with their intervals, a panel per label; colored where the interval leaves 0 out."""
    heights = [len(rows) + 2.5 for rows in panels.values()]
    figure = Figure(figsize=(8, 0.27 * sum(heights) + 0.3), layout="constrained")
    drawn = figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, (label, rows) in zip(drawn, panels.items(), strict=True):
        for place, (_, estimate) in enumerate(rows):
            color = _UP if estimate.low > 0 else _DOWN if estimate.high < 0 else _FLAT
            axes.plot([estimate.low, estimate.high], [place, place], color=color, lw=2, solid_capstyle="butt")
            axes.plot(estimate.mean, place, "o", color=color, ms=5)
        axes.axvline(0, color=INK, lw=0.8)
        axes.set_yticks(range(len(rows)), [name for name, _ in rows], fontsize=9)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.grid(axis="x", color="0.9")
        axes.set_axisbelow(True)
        axes.set_xlabel(label)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a PNG, whole or not at all; the same bytes for the same picture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as file:
        figure.savefig(file, format="png", dpi=_DPI, metadata={"Software": None})


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    columns = min(2, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(6.2 * columns, 3.2 * rows), layout="constrained")
    panels = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes in panels[count:]:
        axes.set_axis_off()
    return figure, panels[:count]


def _colors(studies: Sequence[Study]) -> dict[str, Any]:
    """Return a color per policy, the same in all panels and figures."""
    trained = [name for study in studies for name in study.trained]
    others = [name for study in studies for name in study.policies if name != BEST_FIXED]
    return {BEST_FIXED: _FLAT, **dict(zip(dict.fromkeys(trained + others), cycle(_COLORS), strict=False))}


def _title_and_legend(axes: Axes, study: Study) -> None:
    axes.set_title(fill(study.title, 48), fontsize=10)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)


def _label(study: Study) -> str:
    if study.is_line:
        return "distance at the end"
    return {"mean": "J_mean (m)", "minimum": "J_min (m)"}[study.objective]


def _kind(study: Study) -> str:
    return "line" if study.is_line else f"{study.objective} distance"
