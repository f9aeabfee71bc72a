"""Figure of the cross-play: mean J_mean of every flock policy against every predator."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from flockesc_env.render.palette import LIGHT
from studies.arms_race.results import RaceResults
from training.figure_style import WIDTH

_ROW = 0.34
"""Height of a row in inches."""

_UNTRAINED = {
    "straight": "straight",
    "nearest": "pursuit of nearest",
    "centroid": "pursuit of centroid",
    "lead": "lead pursuit",
}


def cross_play_figure(results: RaceResults) -> Figure:
    """Draw the table; colors are differences to straight flight.

    A frame marks the predator that was trained against the policy.
    """
    rows, columns = results.flocks, results.predators
    means = np.array([[results.cells[flock, predator].mean for predator in columns] for flock in rows])
    colors = LinearSegmentedColormap.from_list("distance", (LIGHT.predator, LIGHT.page, LIGHT.accent))
    figure = Figure(figsize=(WIDTH, _ROW * (len(rows) + 5.5)), layout="constrained")
    axes = figure.subplots()
    changes = means - means[:, [columns.index("straight")]]
    most = np.abs(changes).max()
    axes.imshow(changes, cmap=colors, vmin=-most, vmax=most, aspect="auto", alpha=0.75)
    for row, flock in enumerate(rows):
        for column, predator in enumerate(columns):
            is_own = flock == predator
            style: dict[str, Any] = {
                "ha": "center",
                "va": "center",
                "fontweight": "bold" if is_own else "normal",
            }
            axes.text(column, row, f"{means[row, column]:.1f}", **style)
            if is_own:
                corner = (column - 0.48, row - 0.46)
                axes.add_patch(Rectangle(corner, 0.96, 0.92, fill=False, ec=LIGHT.ink, lw=1.4))
    axes.set_xticks(
        range(len(columns)), [label(name) for name in columns], rotation=35, ha="left", rotation_mode="anchor"
    )
    axes.set_yticks(range(len(rows)), rows)
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xlabel("J_mean (m); color: minus straight flight; frame: trained against the policy of the row")
    axes.xaxis.set_label_position("bottom")
    return figure


def label(predator: str) -> str:
    """Return the name of a predator in tables and figures."""
    return _UNTRAINED.get(predator, f"vs {predator}")
