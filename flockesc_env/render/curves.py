"""Figures of results with Matplotlib: the curve of a sweep, the paths of a line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flockesc_env.common.extras import require
from flockesc_env.models.simulate import LineTrajectory
from flockesc_env.models.sweep import SweepResult
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario.flock import FlockScenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = (6.0, 3.2)  # inches
_LABELS = {
    "min_mean_distance": "smallest mean distance (m)",
    "min_min_distance": "smallest distance of an agent (m)",
    "fraction_surviving": "fraction surviving",
    "escape_distance": "escape distance",
}


def sweep_figure(result: SweepResult, objective: str | None = None) -> Figure:
    """Return the mean objective over interaction ranges, with 95 % intervals and the best fixed range.

    Args:
        result: what ``sweep`` returned. With one seed there are no intervals.
        objective: a key of ``result.objectives``; ``None``: the first one.

    Raises:
        ArgumentError: if the model does not have this objective, or the scenario has no predator.
        MissingExtraError: if the ``analysis`` extra is not installed.
    """
    best = result.best_range(objective)
    ranges, mean = result.interaction_ranges, result.values(objective).mean(axis=1)
    is_flock = isinstance(result.scenario, FlockScenario)
    figure, axes = _axes()
    if len(result.seeds) > 1:
        _, low, high = result.mean_with_interval(objective)
        axes.fill_between(ranges, low, high, color=LIGHT.fixed, alpha=0.2, linewidth=0)
    axes.plot(ranges, mean, color=LIGHT.fixed, marker="o", markersize=3)
    unit = f" {result.scenario.neighbor_rule.unit}" if isinstance(result.scenario, FlockScenario) else ""
    axes.axvline(best, color=LIGHT.accent, linewidth=1)
    axes.set_title(f"best fixed range: {best:.4g}{unit}", color=LIGHT.accent, fontsize=10, loc="left")
    axes.set_xlabel(f"interaction range ({unit.strip()})" if is_flock else "interaction range")
    attribute = result.objectives[objective or next(iter(result.objectives))]
    axes.set_ylabel(_LABELS[attribute])
    return figure


def line_figure(run: LineTrajectory) -> Figure:
    """Return the positions of a line's agents over time, with the predator and its range.

    Args:
        run: what ``simulate_line`` returned.

    Raises:
        MissingExtraError: if the ``analysis`` extra is not installed.
    """
    figure, axes = _axes()
    axes.plot(np.arange(len(run.states)), run.states, color=LIGHT.fixed, linewidth=0.6)
    predator, reach = run.scenario.predator_position, run.scenario.predator_range
    if predator is not None:
        axes.axhspan(predator - reach, predator + reach, color=LIGHT.predator, alpha=0.1, linewidth=0)
        axes.axhline(predator, color=LIGHT.predator, linewidth=1.5)
    axes.set_xlabel("step")
    axes.set_ylabel("position")
    return figure


def _axes() -> tuple[Figure, Axes]:
    require("analysis", ["matplotlib"])
    from matplotlib.figure import Figure  # optional and slow to import

    figure = Figure(figsize=_SIZE, layout="constrained")
    axes = figure.add_subplot()
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes
