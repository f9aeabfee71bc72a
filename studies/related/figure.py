"""Figure of the objectives against the number of neighbors, one curve per speed of the predator."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from flockesc_env.render.palette import LIGHT
from studies.related.attack_speed import NEIGHBORS, SPEEDS, AttackSpeed
from studies.style import curve, letter
from training.figure_style import WIDTH, label_ends


def attack_figure(results: AttackSpeed) -> Figure:
    """Draw the gain over k = 1 against k; a dot marks the best k on tuning flocks."""
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    panels = figure.subplots(1, len(results.best))
    for index, (axes, (symbol, best)) in enumerate(zip(panels, results.best.items(), strict=True)):
        ends = []
        for color, speed, row in zip(LIGHT.others, SPEEDS, best, strict=False):
            curve(axes, NEIGHBORS, row.curve, color, band=0.12, lw=1.8)
            axes.plot(row.neighbors.mean, row.chosen.mean, "o", color=color, ms=6.5, zorder=3)
            ends.append((row.curve[-1].mean, f"{speed:g}x", color))
        axes.axhline(0, color=LIGHT.muted, lw=0.8, zorder=1)
        axes.set_xscale("log")
        axes.set_xticks((1, 2, 4, 7, 14, 30, 100), ("1", "2", "4", "7", "14", "30", "100"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("number of neighbors k")
        axes.set_ylabel(f"{symbol} minus {symbol} at k = 1 (m)")
        axes.grid(axis="y")
        letter(axes, index, f"{symbol}, by the speed of the predator")
        label_ends(axes, ends)
    return figure
