"""J_mean against the range in all presets, one small panel each."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.robustness.page import PresetResult, RobustnessResults
from studies.style import BAND, INK

_COLUMNS = 5
_SYMBOL = "J_mean"
_BEST = "tab:orange"


def against_range(results: RobustnessResults) -> Figure:
    """Draw the figure; the axis of ranges is linear up to 20 and logarithmic beyond."""
    columns = min(_COLUMNS, len(results.presets))
    rows = -(-len(results.presets) // columns)
    figure = Figure(figsize=(2.6 * columns, 2.1 * rows + 0.5), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False)
    for axes, row in zip(panels.flat, results.presets, strict=False):
        _panel(axes, row)
    for axes in panels.flat[len(results.presets) :]:
        axes.set_axis_off()
    for axes in panels[:, 0]:
        axes.set_ylabel(f"{_SYMBOL} (m)", fontsize=7)
    figure.suptitle(f"{results.num_flocks:,} flocks a point, 95 % intervals", fontsize=9)
    return figure


def _panel(axes: Axes, row: PresetResult) -> None:
    outcome, actions = row.outcomes[_SYMBOL], np.array(row.grid.actions)
    mean, low, high = (
        np.array([getattr(point, name) for point in outcome.curve]) for name in ("mean", "low", "high")
    )
    axes.axvspan(outcome.best.low, outcome.best.high, color=_BEST, alpha=0.25, lw=0)
    axes.axvline(outcome.best.mean, color=_BEST, lw=1)
    axes.fill_between(actions, low, high, color=BAND, lw=0)
    axes.plot(actions, mean, ".-", color=INK, lw=1, ms=3)
    axes.set_xscale("symlog", linthresh=20, linscale=1.5)
    ticks = [tick for tick in (0, 5, 10, 20, 50, 100, 300) if tick <= actions[-1]]
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.minorticks_off()
    axes.tick_params(labelsize=7)
    axes.set_title(f"{row.name}: {outcome.finding}", fontsize=7.5)
    axes.set_xlabel(f"range ({row.grid.unit})", fontsize=7)
