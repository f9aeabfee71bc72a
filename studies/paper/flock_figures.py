"""Figures 6 to 10: the flock; and one more: the attack beside its center."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from flockesc_env.common import stats
from flockesc_env.jobs import Arrays
from flockesc_env.models.graph import component_labels
from flockesc_env.models.simulate import Trajectory, simulate
from flockesc_env.models.sweep import FlockSweepResult
from studies.paper.plan import AIMED_GRID, FLOCK, FLOCK_GRID, FULL_RANGE, OFFSETS, SHOWN_FLOCK_RANGES
from studies.style import BAND, INK, PREDATOR, component_colors, letter

_TIMES = (0.0, 4.0, 8.0, 12.0)
_COLORS = dict(zip(SHOWN_FLOCK_RANGES, ("tab:gray", "tab:blue", "tab:orange"), strict=True))
_GRID, _AIMED = np.array(FLOCK_GRID), np.array(AIMED_GRID)
_SYMBOLS = {"mean": "J_mean", "minimum": "J_min"}


def snapshots(seed: int, rho: float) -> Figure:
    """Figures 6, 7 and 8: one flock at four times; agents have the color of their component."""
    run = simulate(FLOCK, rho, seed=seed)
    figure = Figure(figsize=(13, 3.9), layout="constrained")
    panels = figure.subplots(1, len(_TIMES), sharex=True, sharey=True)
    for index, (axes, time) in enumerate(zip(panels, _TIMES, strict=True)):
        _snapshot(axes, run, rho, round(time / FLOCK.time_step))
        letter(axes, index)
        axes.set_xlabel("x (m)")
    panels[0].set_ylabel("y (m)")
    figure.suptitle(f"rho = {rho:g} m, flock of seed {seed}; red: predator, its path and its range")
    return figure


def _snapshot(axes: Axes, run: Trajectory, rho: float, step: int) -> None:
    positions = run.positions[step]
    colors = component_colors(component_labels(None, positions, rho))
    axes.quiver(*positions.T, *run.velocities[step].T, color=colors, scale=260, width=0.006)
    path = run.predator_positions[: step + 1, 0]
    axes.plot(*path.T, color=PREDATOR, lw=0.8, alpha=0.6)
    axes.plot(*path[-1], "o", color=PREDATOR, ms=5)
    axes.add_patch(Circle((path[-1, 0], path[-1, 1]), FLOCK.predator_range, color=PREDATOR, alpha=0.12, lw=0))
    axes.set_aspect("equal")
    axes.set(xlim=(-130, 230), ylim=(-130, 230))
    number = run.num_components[step]
    axes.set_title(f"t = {run.times[step]:g} s, {number} component{'' if number == 1 else 's'}", fontsize=9)


def distances(objective: str, curves: Arrays, grid: Arrays, seed: int) -> Figure:
    """Figures 9 and 10: distance against time, objective against range, and the best ranges of flocks."""
    column = {"mean": "mean_distance", "minimum": "min_distance"}[objective]
    values = grid[f"min_{column}"]
    figure = Figure(figsize=(13, 4.2), layout="constrained")
    over_time, over_range, best = figure.subplots(1, 3)
    for index, axes in enumerate((over_time, over_range, best)):
        letter(axes, index)
    times = np.arange(FLOCK.num_steps + 1) * FLOCK.time_step
    for row, (rho, color) in zip(curves[column], _COLORS.items(), strict=True):
        over_time.plot(times, row[seed], color=color, label=f"rho = {rho:g} m")
        over_time.plot(times, row.mean(axis=0), color=color, ls=":", lw=1)
    over_time.set(xlabel="t (s)", ylabel=f"{objective} predator distance (m)")
    over_time.set_title(f"line: flock of seed {seed}, dots: mean of all", fontsize=10)
    over_time.legend(frameon=False, fontsize=8)

    center, low, high = _result(grid).mean_with_interval(objective)
    over_range.fill_between(_GRID, low, high, color=BAND, lw=0)
    over_range.plot(_GRID, center, color=INK, label=f"mean of {values.shape[1]:,} flocks, 95 % interval")
    over_range.plot(_GRID, values[:, seed], color="tab:blue", lw=0.8, label=f"flock of seed {seed}")
    over_range.set(xlabel="rho (m)", ylabel=f"{_SYMBOLS[objective]} (m)")
    over_range.legend(frameon=False, fontsize=8)

    place = stats.argmax(_GRID, values)
    best.hist(_GRID[np.argmax(values, axis=0)], bins=np.arange(-2.5, 105, 5), color="tab:blue", alpha=0.7)
    best.axvspan(place.low, place.high, color="tab:orange", alpha=0.25, lw=0)
    best.axvline(place.mean, color="tab:orange", label=f"best in expectation: {place.mean:g} m")
    best.axvline(10, color=PREDATOR, ls="--", lw=1, label="the paper's 10 m")
    best.set(xlabel="best range of a flock (m)", ylabel="flocks")
    best.legend(frameon=False, fontsize=8)
    return figure


def aimed_beside(aimed: dict[float, Arrays]) -> Figure:
    """Draw, for an attack beside the center, the best range, and full connectivity against 10 m."""
    figure = Figure(figsize=(10, 6.4), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True)
    for column, (objective, symbol) in enumerate(_SYMBOLS.items()):
        key = {"mean": "min_mean_distance", "minimum": "min_min_distance"}[objective]
        above, below = panels[:, column]
        values = [aimed[offset][key] for offset in OFFSETS]
        _points(above, [stats.argmax(_AIMED, rows) for rows in values])
        full, short = AIMED_GRID.index(FULL_RANGE), AIMED_GRID.index(10.0)
        _points(below, [stats.mean(rows[full] - rows[short]) for rows in values])
        above.set(ylabel="best range in expectation (m)", ylim=(0, 105))
        above.set_title(symbol, fontsize=10)
        below.axhline(0, color=INK, lw=0.6)
        below.set(
            xlabel="the predator's path misses the center by (m)",
            ylabel=f"{symbol}(100 m) - {symbol}(10 m) (m)",
        )
        letter(above, column)
        letter(below, 2 + column)
    figure.suptitle(f"{values[0].shape[1]:,} flocks a point, 95 % intervals")
    return figure


def _points(axes: Axes, estimates: list[stats.Estimate]) -> None:
    means, low, high = (
        np.array([getattr(estimate, name) for estimate in estimates]) for name in ("mean", "low", "high")
    )
    axes.errorbar(OFFSETS, means, (means - low, high - means), fmt="o-", ms=4, lw=1, capsize=3)


def _result(grid: Arrays) -> FlockSweepResult:
    seeds = np.arange(grid["num_components"].shape[1], dtype=np.uint64)
    return FlockSweepResult(FLOCK, _GRID, seeds, **grid)
