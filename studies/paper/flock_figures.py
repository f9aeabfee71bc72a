"""Figures of the flock: 6 to 10 of the paper, an attack beside its center, and the controls."""

from collections.abc import Mapping

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
from studies.measurements import means
from studies.paper import plan
from studies.paper.flock_claims import gain_of_100
from studies.paper.mechanism_claims import flock_values
from studies.paper.plan import FLOCK, NO_FORCE, OFFSETS, PAPER_FORCE, PAPER_OBJECTIVES
from studies.style import caption, component_colors, curve, letter, subplots
from training.figure_style import BAND, RANGES, draw_predator, label_ends

_TIMES = (0.0, 4.0, 8.0, 12.0)
_COLORS = {rho: to_hex(RANGES(min(rho / 20.0, 1.0))) for rho in plan.SHOWN_FLOCK_RANGES}
"""Colors of the ranges; the scale ends at 20 m, as on the page."""
_GRID, _AIMED = np.array(plan.FLOCK_GRID), np.array(plan.AIMED_GRID)
_TICKS = (0, 2, 5, 10, 20, 50, 100)
_STRONGEST = to_hex(RANGES(0.95))
_FORCE_COLORS = {NO_FORCE: LIGHT.accent, 1.0: LIGHT.alone, PAPER_FORCE: LIGHT.fixed, 100.0: _STRONGEST}


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
    values = measured["grid flock"][spec.name]
    best = stats.argmax(_GRID, values)
    figure, (over_time, over_range, histogram) = subplots(3.5, 1, 3)
    times, ends = np.arange(FLOCK.num_steps + 1) * FLOCK.time_step, []
    for flocks, (rho, color) in zip(measured["curves"][spec.series], _COLORS.items(), strict=True):
        over_time.plot(times, flocks[seed], color=color, lw=1.5)
        over_time.plot(times, flocks.mean(axis=0), color=color, ls=":", lw=1.2)
        ends.append((float(flocks[seed][-1]), f"{rho:g} m", color))
    over_time.set(xlabel="time (s)", ylabel=spec.with_unit(spec.label))
    over_time.margins(x=0)
    label_ends(over_time, ends)
    center, low, high = stats.mean_with_interval(values, stats.CONFIDENCE)
    over_range.fill_between(_GRID, low, high, color=BAND, lw=0)
    over_range.plot(_GRID, values[:, seed], color=LIGHT.alone, lw=1)
    over_range.plot(_GRID, center, color=LIGHT.fixed, lw=2)
    over_range.set(ylabel=spec.with_unit(spec.symbol))
    bins = np.arange(-2.5, 105, 5).tolist()
    histogram.hist(_GRID[np.argmax(values, axis=0)], bins=bins, color=LIGHT.alone)
    histogram.axvspan(best.low, best.high, color=LIGHT.fixed, alpha=0.25, lw=0)
    histogram.axvline(best.mean, color=LIGHT.fixed, lw=2)
    histogram.axvline(10, color=LIGHT.accent, ls="--", lw=1.5)
    histogram.set(ylabel="flocks")
    for axes in (over_range, histogram):
        axes.margins(x=0)
        axes.set_xlabel("interaction range (m)")
    letter(
        over_time, 0, f"distance over time\nsolid: flock {seed}\ndotted: mean of {values.shape[1]:,} flocks"
    )
    letter(over_range, 1, f"{spec.symbol} against the range\nlight: flock {seed}\ndark: mean, 95 % interval")
    expected = f"{best.mean:g} m [{best.low:g}, {best.high:g}]"
    letter(histogram, 2, f"best range of flocks\nsolid: mean, {expected}\ndashed: the paper's 10 m")
    return figure


def aimed_beside(measured: Mapping[str, Arrays]) -> Figure:
    """Draw the best range, and 100 m minus 10 m, against the predator's distance from the center."""
    figure, panels = subplots(5.6, 2, 2, sharex=True)
    for column, spec in enumerate(PAPER_OBJECTIVES):
        symbol, (above, below) = spec.symbol, panels[:, column]
        values = [measured[f"aimed {offset:g}"][spec.name] for offset in OFFSETS]
        _points(above, [stats.argmax(_AIMED, rows) for rows in values])
        _points(below, [stats.mean(gain_of_100(rows)) for rows in values])
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
    """Draw an estimate with its interval at every offset."""
    means, below, above = zip(*((e.mean, e.mean - e.low, e.high - e.mean) for e in estimates), strict=True)
    axes.errorbar(OFFSETS, means, (below, above), fmt="o", ms=5, lw=1.5, color=LIGHT.fixed)


def by_force(results: Mapping[str, Arrays]) -> Figure:
    """Draw the three objectives against the range, one curve per escape force."""
    figure, panels = subplots(3.3, 1, len(FLOCK_OBJECTIVES))
    for index, (axes, spec) in enumerate(zip(panels, FLOCK_OBJECTIVES.values(), strict=True)):
        ends = []
        for strength, color in _FORCE_COLORS.items():
            values = (1 if spec.unit else 100) * flock_values(results, plan.PAPER, strength, spec)
            style = "-" if strength == PAPER_FORCE else "--"
            curve(axes, plan.CONTROL_GRID, means(values), color, style, band=0.2, lw=1.6)
            ends.append((float(values[-1].mean()), f"s = {strength:g}", color))
        # The square root of the axis keeps short ranges apart.
        axes.set_xscale("function", functions=(lambda x: np.sqrt(np.maximum(x, 0)), np.square))
        axes.set_xticks(_TICKS, [str(tick) for tick in _TICKS])
        axes.set(xlabel="interaction range (m)", xlim=(0, plan.CONTROL_GRID[-1]))
        label_ends(axes, ends)
        letter(axes, index, f"{spec.symbol} ({spec.unit or '%'})")
    survival = f"Survival: agents within {plan.CAPTURE_RADIUS:g} m of the predator are caught"
    caption(figure, f"Escape force s (0: nobody flees; 10: the paper's). {survival}")
    return figure
