"""Figures of the details page: gains, learning curves, performance profiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.objectives import OBJECTIVES
from flockesc_env.render.palette import LIGHT
from flockesc_env.tasks.statistics import Profile
from studies.findings.kinds import kind_of
from studies.findings.names import policy_title, setting_title
from studies.findings.results import BEST_FIXED, ORACLE, Study
from studies.findings.summary import Summary
from studies.forest import ROW, Group, draw_forest, num_lines
from training.figure_style import WIDTH

SHOWN = ("shared", "per-agent-visible")
"""Settings with learning curves and performance profiles; the page's tables have all."""

_COLORS = {
    "search": LIGHT.learned,
    BEST_FIXED: LIGHT.fixed,
    ORACLE: LIGHT.alone,
    "ppo": LIGHT.others[0],
    "tqc": LIGHT.others[1],
    "imitation": LIGHT.others[2],
    "schedule": LIGHT.others[4],
    "listen-while-fleeing": LIGHT.others[0],
    "stubborn-leaders": LIGHT.others[0],
}
"""Colors by policy; other policies are muted."""


def shown_studies(studies: Sequence[Study]) -> list[Study]:
    """Return the settings of ``SHOWN``; the first one if none of them was run."""
    return [study for study in studies if study.setting in SHOWN] or list(studies[:1])


def learning_curves(studies: Sequence[Study]) -> Figure:
    """Draw the objective on tuning flocks against episodes: median and range over training seeds."""
    figure, panels = _panels(len(studies))
    for axes, study in zip(panels, studies, strict=True):
        axes.set_xscale("log")
        for name in filter(_COLORS.__contains__, study.trained):
            color, value = _COLORS[name], pl.col("objective")
            points = study.curves.filter(learner=name).group_by("episodes")
            table = points.agg(
                value.median().alias("median"), value.min().alias("low"), value.max().alias("high")
            )
            episodes, median, low, high = table.sort("episodes").to_numpy().T
            axes.fill_between(episodes, low, high, color=color, alpha=0.15, lw=0)
            axes.plot(episodes, median, color=color, lw=2)
            _label_end(axes, episodes[-1], median[-1], name, policy_title(study, name))
        level = float(study.values(BEST_FIXED).mean())
        axes.axhline(level, color=LIGHT.fixed, ls="--", lw=1.2)
        axes.annotate(
            policy_title(study, BEST_FIXED),
            (1.0, level),
            xytext=(0, 4),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            color=LIGHT.fixed,
            ha="right",
        )
        axes.xaxis.set_minor_formatter(NullFormatter())  # its labels overlap
        axes.set(xlabel="training episodes", ylabel=f"{objective_label(study)} on tuning flocks")
        axes.set_title(setting_title(study))
        axes.margins(x=0.02, y=0.12)
    return figure


def gains(summaries: Sequence[Summary]) -> Figure:
    """Draw the paired gain of every rule and learner, a panel per objective, rows grouped by setting."""
    panels: dict[str, list[Group]] = {}
    for spec in OBJECTIVES:
        label, unit = ("line", "no unit") if spec.model == "line" else (spec.label, spec.unit or "no unit")
        groups = [
            Group(
                setting_title(summary.study),
                [
                    (policy_title(summary.study, name), summary.policies[name].difference)
                    for name in summary.study.policies
                    if kind_of(summary.study, name)
                ],
            )
            for summary in summaries
            if summary.study.spec == spec
        ]
        if groups:
            panels[f"{label}: gain over the best fixed range ({unit})"] = groups
    return forests(panels)


def performance_profiles(studies: Sequence[Study], profiles: Mapping[str, Mapping[str, Profile]]) -> Figure:
    """Draw the share of episodes above every value of the objective, with 95 % bands."""
    figure, panels = _panels(len(studies))
    for axes, study in zip(panels, studies, strict=True):
        values = thresholds(study)
        for name, profile in profiles[study.setting].items():
            color = _COLORS.get(name, LIGHT.alone)
            axes.fill_between(values, profile.low, profile.high, color=color, alpha=0.15, lw=0)
            style = "--" if name in (BEST_FIXED, ORACLE) else "-"
            axes.plot(values, profile.share, style, color=color, lw=2, label=policy_title(study, name))
        # The lower left corner is empty: almost all episodes are above the lowest values.
        axes.legend(loc="lower left", labelcolor="linecolor", reverse=True)
        axes.set(xlabel=objective_label(study), ylabel="share of held-out episodes above", ylim=(0, 1.02))
        axes.set_title(setting_title(study))
        axes.margins(x=0)
    return figure


def profiled(study: Study) -> list[str]:
    """Return the policies whose profiles are drawn: fixed ranges, built-in rules and the best learner."""
    return [name for name in study.policies if name not in study.learners] + [study.best_learner]


def thresholds(study: Study) -> FloatArray:
    """Return where performance profiles are taken: most of what any policy reaches, shape (61,)."""
    low, high = study.episodes["objective"].quantile(0.005), study.episodes["objective"].quantile(0.995)
    return np.linspace(low or 0.0, high or 0.0, 61)


def forests(panels: Mapping[str, Sequence[Group]], color: str = LIGHT.learned) -> Figure:
    """Draw a forest plot per axis label, one below the other."""
    heights = [num_lines(groups) + 2.6 for groups in panels.values()]
    figure = Figure(figsize=(WIDTH, ROW * sum(heights)), layout="constrained")
    drawn = figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, (label, groups) in zip(drawn, panels.items(), strict=True):
        draw_forest(axes, groups, color, digits=3 if label.startswith("line") else 1)
        axes.set_xlabel(label)
    return figure


def objective_label(study: Study) -> str:
    """Return the name of the objective with its unit."""
    if study.is_line:
        return "distance to the predator at the end"
    return study.spec.with_unit(study.spec.symbol)


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(WIDTH, 3.3 * count), layout="constrained")
    return figure, list(figure.subplots(count, 1, squeeze=False).flat)


def _label_end(axes: Axes, x: float, y: float, name: str, title: str) -> None:
    """Write a policy's title at the end of its curve, on the side with more room."""
    side = "left" if axes.transData.transform((x, y))[0] < axes.bbox.x0 + axes.bbox.width / 2 else "right"
    below = name == "schedule"  # its curve runs below another one
    axes.annotate(
        title,
        (x, y),
        xytext=(0, -14 if below else 5),
        textcoords="offset points",
        color=_COLORS[name],
        ha=side,
        va="top" if below else "bottom",
    )
