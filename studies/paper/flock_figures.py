"""Figures 6 to 10 of the paper (the flock), and the figure of an attack beside its center."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from flockesc_env import simulate
from flockesc_env.common import stats
from flockesc_env.jobs import Arrays
from flockesc_env.models.graph import component_labels
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES
from studies.paper.plan import AIMED_GRID, FLOCK, FLOCK_GRID, OFFSETS, PAPER_OBJECTIVES, SHOWN_FLOCK_RANGES
from studies.style import caption, component_colors, letter, subplots
from training.figure_style import BAND, RANGES, draw_predator, label_ends

_TIMES = (0.0, 4.0, 8.0, 12.0)
_COLORS = {rho: to_hex(RANGES((rho / 100.0) ** 0.5)) for rho in SHOWN_FLOCK_RANGES}
"""Colors of the ranges; the square root keeps 10 m apart from 0."""
_GRID, _AIMED = np.array(FLOCK_GRID), np.array(AIMED_GRID)


def snapshots(seed: int, rho: float) -> Figure:
    """Figures 6, 7 and 8: one flock at four times; agents have the color of their component."""
    run = simulate(FLOCK, rho, seed=seed)
    figure, panels = subplots(2.75, 1, len(_TIMES), sharex=True, sharey=True)
    for axes, time in zip(panels, _TIMES, strict=True):
        step = round(time / FLOCK.time_step)
        positions, path = run.positions[step], run.predator_positions[: step + 1, 0]
        colors = component_colors(component_labels(None, positions, rho))
        draw_predator(axes, path, FLOCK.predator_range)
        axes.quiver(*positions.T, *run.velocities[step].T, color=colors, scale=240, width=0.008)
        axes.set_aspect("equal")
        axes.set(xlim=(-130, 230), ylim=(-130, 230), xlabel="x (m)")
        number = run.num_components[step]
        axes.set_title(f"{time:g} s, {number} component{'' if number == 1 else 's'}", fontsize=9)
    panels[0].set_ylabel("y (m)")
    text = f"Range {rho:g} m, flock of seed {seed}; color: component, gray: alone, vermilion: predator"
    caption(figure, text)
    return figure


def distances(objective: str, measured: Mapping[str, Arrays], seed: int) -> Figure:
    """Figures 9 and 10: distance against time, objective against range, and the best ranges of flocks."""
    spec = FLOCK_OBJECTIVES[objective]
    symbol, values = spec.symbol, measured["grid flock"][spec.name]
    figure, ((over_time, over_range), (best, spare)) = subplots(6.0, 2, 2)
    spare.set_axis_off()
    times = np.arange(FLOCK.num_steps + 1) * FLOCK.time_step
    ends = []
    for row, (rho, color) in zip(measured["curves"][spec.series], _COLORS.items(), strict=True):
        over_time.plot(times, row[seed], color=color, lw=1.5)
        over_time.plot(times, row.mean(axis=0), color=color, ls=":", lw=1.2)
        ends.append((float(row[seed][-1]), f"{rho:g} m", color))
    over_time.set(xlabel="time (s)", ylabel=spec.with_unit(spec.label))
    over_time.margins(x=0)
    letter(over_time, 0, "distance over time, three ranges")
    label_ends(over_time, ends)

    center, low, high = stats.mean_with_interval(values, stats.CONFIDENCE)
    over_range.fill_between(_GRID, low, high, color=BAND, lw=0)
    over_range.plot(_GRID, values[:, seed], color=LIGHT.alone, lw=1)
    over_range.plot(_GRID, center, color=LIGHT.fixed, lw=2)
    over_range.margins(x=0)
    over_range.set(xlabel="interaction range (m)", ylabel=spec.with_unit(symbol))
    letter(over_range, 1, f"{symbol} against the range")

    place = stats.argmax(_GRID, values)
    best.hist(_GRID[np.argmax(values, axis=0)], bins=np.arange(-2.5, 105, 5), color=LIGHT.alone)
    best.axvspan(place.low, place.high, color=LIGHT.fixed, alpha=0.25, lw=0)
    best.axvline(place.mean, color=LIGHT.fixed, lw=2)
    best.axvline(10, color=LIGHT.accent, ls="--", lw=1.5)
    best.margins(x=0)
    best.set(xlabel="interaction range (m)", ylabel="flocks")
    letter(best, 2, "best range of each flock")
    notes = [
        (f"(a) solid: flock of seed {seed}", LIGHT.ink),
        (f"(a) dotted: mean of {values.shape[1]:,} flocks", LIGHT.ink),
        (f"(b) dark: mean of {values.shape[1]:,} flocks, 95 % interval", LIGHT.fixed),
        (f"(b) light: flock of seed {seed}", LIGHT.alone),
        ("(c) bars: flocks by their best range", LIGHT.alone),
        (f"(c) solid: best in expectation, {place.mean:g} m [{place.low:g}, {place.high:g}]", LIGHT.fixed),
        ("(c) dashed: the paper's 10 m", LIGHT.accent),
    ]
    for line, (text, color) in enumerate(notes):
        spare.text(0.0, 0.95 - 0.125 * line, text, color=color, va="top", in_layout=False)
    return figure


def aimed_beside(aimed: dict[float, Arrays]) -> Figure:
    """Draw the best range, and 100 m minus 10 m, against the predator's distance from the center."""
    figure, panels = subplots(5.6, 2, 2, sharex=True)
    for column, spec in enumerate(PAPER_OBJECTIVES):
        symbol = spec.symbol
        above, below = panels[:, column]
        values = [aimed[offset][spec.name] for offset in OFFSETS]
        _points(above, [stats.argmax(_AIMED, rows) for rows in values])
        full, short = AIMED_GRID.index(100.0), AIMED_GRID.index(10.0)
        _points(below, [stats.mean(rows[full] - rows[short]) for rows in values])
        above.set(ylim=(0, 105))
        letter(above, column, f"{symbol}: best range in expectation")
        below.axhline(0, color=LIGHT.ink, lw=0.8)
        below.set(xlabel="the predator's path misses the center by (m)")
        letter(below, 2 + column, f"{symbol} at 100 m minus {symbol} at 10 m")
    panels[0, 0].set_ylabel("interaction range (m)")
    panels[1, 0].set_ylabel("difference (m)")
    caption(figure, f"An attack beside the center: {values[0].shape[1]:,} flocks a point, 95 % intervals")
    return figure


def _points(axes: Axes, estimates: list[stats.Estimate]) -> None:
    means, low, high = np.array([astuple(estimate) for estimate in estimates]).T
    axes.errorbar(OFFSETS, means, (means - low, high - means), fmt="o", ms=5, lw=1.5, color=LIGHT.fixed)
