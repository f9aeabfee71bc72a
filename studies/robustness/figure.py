"""Forest plot of the gains of the best fixed range in all presets."""

from __future__ import annotations

from matplotlib.figure import Figure

from flockesc_env.render.palette import LIGHT
from studies.forest import ROW, Group, draw_forest, num_lines
from studies.robustness.page import PresetResult, RobustnessResults
from studies.robustness.questions import QUESTIONS
from studies.style import caption
from training.figure_style import WIDTH

_SYMBOL = "J_mean"
_GAINS = {"gain_over_zero": "gain over range 0 (m)", "gain_over_longest": "gain over the longest range (m)"}


def gains(results: RobustnessResults) -> Figure:
    """Draw both gains in ``J_mean`` of every preset, side by side; presets are grouped by question."""
    panels = {gain: _groups(results, gain) for gain in _GAINS}
    lines = num_lines(panels["gain_over_zero"])
    figure = Figure(figsize=(WIDTH, ROW * (lines + 4)), layout="constrained")
    drawn = figure.subplots(1, len(panels))
    for axes, (gain, groups) in zip(drawn, panels.items(), strict=True):
        draw_forest(axes, groups, LIGHT.fixed)
        axes.set_xlabel(_GAINS[gain])
    drawn[1].set_yticklabels([])
    caption(
        figure,
        f"{_SYMBOL} of the best fixed range, {results.num_flocks:,} flocks, 95 % intervals"
        " (filled: the interval excludes 0)",
    )
    return figure


def _groups(results: RobustnessResults, gain: str) -> list[Group]:
    groups = []
    for question in QUESTIONS:
        presets = [preset for preset in results.presets if preset.question == question]
        rows = [(_label(preset), getattr(preset.outcomes[_SYMBOL], gain)) for preset in presets]
        if rows:
            groups.append(Group(question, rows))
    return groups


def _label(preset: PresetResult) -> str:
    best = preset.outcomes[_SYMBOL].best.mean
    return f"{preset.name} ({best:g} {preset.grid.unit})"
