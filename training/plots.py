"""Figures: objective against range, one flock over time, one flock under attack. Matplotlib, no display."""

from __future__ import annotations

from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from flockesc_env import FlockScenario, FlockSweepResult, NamedPolicy, Trajectory
from flockesc_env.common import stats
from flockesc_env.common.stats import FloatArray
from flockesc_env.render.palette import LIGHT

Run = tuple[str, Trajectory]
"""Name of a policy, and what the flock did under it."""

_DPI = 150
_RANGES = LinearSegmentedColormap.from_list("ranges", LIGHT.ranges)
_LABELS = {"mean": "min. over time of mean predator distance (m)", "minimum": "min. predator distance (m)"}


def _colors(count: int) -> list[str]:
    """Return a color per policy: the first is the best fixed range, the last the policy compared with it."""
    return [LIGHT.fixed, *islice(cycle(LIGHT.others), count - 2), LIGHT.learned]


def objective_against_range(
    search: FlockSweepResult, objective: str, outcomes: dict[str, FloatArray], folder: Path
) -> Path:
    """Draw the grid search's mean objective with its band, and a level per policy; return the file."""
    figure = Figure(figsize=(8, 4.8), layout="constrained")
    axes = figure.subplots()
    center, low, high = search.mean_with_interval(objective)
    ranges = search.interaction_ranges
    axes.fill_between(ranges, low, high, color="0.85", lw=0)
    axes.plot(ranges, center, color="0.3", label="fixed range, same for all agents")
    for (name, values), color in zip(outcomes.items(), _colors(len(outcomes)), strict=True):
        level = stats.mean(values)
        axes.axhspan(level.low, level.high, color=color, alpha=0.2, lw=0)
        axes.axhline(level.mean, color=color, label=f"{name}: {level.mean:.1f}")
    axes.set_xlabel("interaction range (m)")
    axes.set_ylabel(_LABELS[objective])
    axes.set_title(f"{len(search.seeds)} held-out flocks, 95 % intervals")
    axes.margins(x=0)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    return _save(figure, folder / "objective_against_range")


def record_both(baseline: NamedPolicy, policy: NamedPolicy, scenario: FlockScenario, seed: int) -> list[Run]:
    """Run two policies on the same flock."""
    return [(entry.name, entry.record(seed, scenario)) for entry in (baseline, policy)]


def flock_over_time(runs: list[Run], folder: Path) -> Path:
    """Draw distances and ranges against time for one flock under each policy; return the file."""
    figure = Figure(figsize=(8, 6), layout="constrained")
    above, below = figure.subplots(2, sharex=True)
    for (name, trajectory), color in zip(runs, _colors(len(runs)), strict=True):
        times, ranges = trajectory.times, trajectory.interaction_ranges
        above.plot(times, trajectory.mean_distance, color=color, label=name)
        at = int(np.argmin(trajectory.mean_distance))
        above.plot(times[at], trajectory.mean_distance[at], "o", color=color)
        if ranges.shape[1] > 1:
            _shares(below, times, ranges)
        below.stairs(ranges.mean(axis=1), times, baseline=None, color=color, lw=1.5, zorder=2)
    above.set_ylabel("mean predator distance (m)")
    above.set_title(f"Flock of seed {runs[0][1].seed}: the dot is the objective")
    above.legend(frameon=False)
    below.set_ylabel("interaction range (m)\nline: mean, shade: share of agents")
    below.set_xlabel("time (s)")
    below.margins(x=0)
    return _save(figure, folder / "flock_over_time")


def _shares(axes: Axes, times: FloatArray, ranges: FloatArray, bins: int = 20) -> None:
    """Shade how many agents have which range at which time."""
    edges = np.linspace(0, ranges.max(), bins + 1)
    shares = np.array([np.histogram(row, edges)[0] / row.size for row in ranges])
    axes.pcolormesh(times, edges, shares.T, cmap="Oranges", vmin=0, vmax=0.6, alpha=0.7, zorder=0)


def flock_under_attack(runs: list[Run], folder: Path, times: tuple[float, ...] = (0, 3, 6, 9)) -> Path:
    """Draw snapshots of one flock, a row per policy, agents colored by their range; return the file."""
    figure = Figure(figsize=(3 * len(times), 3.2 * len(runs)), layout="constrained")
    top = max(float(np.quantile(run.interaction_ranges, 0.99)) for _, run in runs)
    drawn = []
    corners = []
    arrows: Any = None
    parts = figure.subfigures(len(runs), 1, squeeze=False)[:, 0]
    for part, (name, trajectory) in zip(parts, runs, strict=True):
        part.suptitle(name, fontsize=11)
        row = part.subplots(1, len(times), sharex=True, sharey=True, squeeze=False)[0]
        for axes, time in zip(row, times, strict=True):
            step = min(round(time / trajectory.scenario.time_step), trajectory.scenario.num_steps - 1)
            arrows = _snapshot(axes, trajectory, step, top)
            corners.append(np.quantile(trajectory.positions[step, :, :2], [0, 1], axis=0))
            reach = trajectory.scenario.predator_range
            corners += [trajectory.predator_positions[step, :, :2] + d for d in (-reach, reach)]
            axes.set_xlabel("x (m)")
        row[0].set_ylabel("y (m)")
        part.colorbar(arrows, ax=row, label="interaction range (m)")
        drawn.append(row[0])
    seen = np.concatenate(corners)
    low, high = seen.min(axis=0) - 12, seen.max(axis=0) + 12
    for axes in drawn:
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return _save(figure, folder / "flock_under_attack")


def _snapshot(axes: Axes, trajectory: Trajectory, step: int, top: float) -> Any:
    positions, velocities = trajectory.positions[step, :, :2], trajectory.velocities[step, :, :2]
    colors = np.broadcast_to(trajectory.interaction_ranges[step], len(positions))
    arrows = axes.quiver(
        *positions.T, *velocities.T, colors, cmap=_RANGES, clim=(0, top), scale=250, width=0.007
    )
    for path in trajectory.predator_positions[: step + 1, :, :2].transpose(1, 2, 0):
        axes.plot(*path, color=LIGHT.predator, lw=0.8, alpha=0.6)
        here = (path[0, -1], path[1, -1])
        axes.plot(*here, "o", color=LIGHT.predator, markersize=5)
        axes.add_patch(Circle(here, trajectory.scenario.predator_range, color=LIGHT.predator, alpha=0.12))
    axes.set_aspect("equal")
    mean = trajectory.mean_distance[step]
    axes.set_title(f"t = {trajectory.times[step]:.0f} s, mean distance {mean:.0f} m", fontsize=9)
    return arrows


def _save(figure: Figure, stem: Path) -> Path:
    """Write PNG and SVG; return the PNG."""
    figure.savefig(stem.with_suffix(".svg"))
    figure.savefig(stem.with_suffix(".png"), dpi=_DPI)
    return stem.with_suffix(".png")
