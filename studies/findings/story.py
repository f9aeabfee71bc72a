"""The figure that tells the story: gains of the best policies and of the references, setting by setting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES, ObjectiveSpec
from flockesc_env.render.palette import LIGHT
from studies.findings.names import CLAIRVOYANT, FREE_HEADINGS, INFORMED_GREEDY, PLANNER
from studies.findings.results import BEST_FIXED
from studies.findings.summary import Summary
from training.figure_style import WIDTH

_SETTINGS = {
    "shared": "one range for all agents,\npredator always seen",
    "per-agent-local": "one range per agent,\npredator seen within 30 m",
    "per-agent-visible": "one range per agent,\npredator always seen",
    "steering-predator": "one range per agent,\npredator always seen, steers",
}
_OBSERVATIONS = {
    "": ("plain observation", LIGHT.learned),
    "-derived": ("with the escape direction", LIGHT.others[1]),
    "-profile": ("with a profile", LIGHT.others[0]),
}
"""Ends of the names of settings that differ in what agents observe, with a label and a color."""

_COLUMN = 148
"""Distance between the gains above a bar, in points."""

_REFERENCES = {
    PLANNER: "planner",
    CLAIRVOYANT: "clairvoyant",
    INFORMED_GREEDY: "informed greedy",
    FREE_HEADINGS: "bound",
}


@dataclass(frozen=True)
class Row:
    """One bar: gain over the best fixed range."""

    title: str
    gains: dict[str, tuple[float, str]]
    """By the end of the setting's name: gain of the best policy, and its kind."""
    references: dict[str, float]


def story(summaries: Sequence[Summary]) -> Figure | None:
    """Draw the gains, a panel per objective and a bar per setting; ``None`` if no such setting was run."""
    by_name = {summary.study.setting: summary for summary in summaries}
    panels = {
        spec.with_unit(f"{spec.label.capitalize()} {spec.symbol}: gain over the best fixed range"): _rows(
            by_name, spec
        )
        for spec in FLOCK_OBJECTIVES.values()
    }
    panels = {label: rows for label, rows in panels.items() if rows}
    if not panels:
        return None
    heights = [len(rows) + 0.9 for rows in panels.values()]
    figure = Figure(figsize=(WIDTH, 0.78 * sum(heights) + 0.3), layout="constrained")
    drawn = figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights)[:, 0]
    for axes, (label, rows) in zip(drawn, panels.items(), strict=True):
        _draw(axes, rows, label)
    _legend(figure)
    return figure


def _rows(by_name: Mapping[str, Summary], objective: ObjectiveSpec) -> list[Row]:
    end = "" if objective == next(iter(FLOCK_OBJECTIVES.values())) else f"-{objective.name}"
    rows = []
    for name, title in _SETTINGS.items():
        plain = by_name.get(f"{name}{end}")
        if plain is None:
            continue
        fixed = objective.text(plain.policies[BEST_FIXED].objective.mean)
        settings = {key: by_name.get(f"{name}{key}{end}") for key in _OBSERVATIONS}
        rows.append(
            Row(
                f"{name}{end}:\n{title}\nbest fixed: {fixed}",
                {key: _best(summary) for key, summary in settings.items() if summary},
                {reference: found.difference.mean for reference, found in plain.references.items()},
            )
        )
    return rows


def _best(summary: Summary) -> tuple[float, str]:
    kind = summary.chosen
    return summary.policies[summary.best[kind]].difference.mean, kind


def _draw(axes: Axes, rows: Sequence[Row], label: str) -> None:
    for place, row in enumerate(rows):
        longest_first = sorted(row.gains, key=lambda key: row.gains[key], reverse=True)
        end = max([row.gains[longest_first[0]][0], *row.references.values()])
        axes.barh(place, end, 0.42, color=LIGHT.grid)
        for key in longest_first:
            axes.barh(place, row.gains[key][0], 0.42, color=_OBSERVATIONS[key][1])
        for column, (key, (gain, kind)) in enumerate(row.gains.items()):
            style = {"va": "bottom", "color": _OBSERVATIONS[key][1], "weight": "bold"}
            _note(axes, (0.0, place - 0.21), f"{kind} {gain:+.1f}", (1 + column * _COLUMN, 1), **style)
        axes.vlines(list(row.references.values()), place - 0.21, place + 0.27, color=LIGHT.ink, lw=1.8)
        ordered = sorted(row.references.items(), key=lambda item: item[1])
        names = [f"{_REFERENCES[name]} {gain:+.1f}" for name, gain in ordered]
        end = ordered[-1][1] if ordered else 0.0
        _note(axes, (end, place + 0.28), "   ".join(names), (2, -1), ha="right", va="top", fontsize=8)
    axes.set_yticks(range(len(rows)), [row.title for row in rows])
    axes.tick_params(axis="y", length=0)
    axes.set(ylim=(len(rows) - 0.4, -0.6), xlim=(0, None), title=label)
    axes.spines["bottom"].set_visible(False)


def _note(axes: Axes, at: tuple[float, float], text: str, offset: tuple[int, int], **style: Any) -> None:
    axes.annotate(text, at, xytext=offset, textcoords="offset points", **style)


def _legend(figure: Figure) -> None:
    handles = [
        *(Patch(color=color, label=label) for label, color in _OBSERVATIONS.values()),
        Patch(color=LIGHT.grid, label="not reached"),
        Line2D([], [], color=LIGHT.ink, lw=1.8, label="reference"),
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=len(handles))
