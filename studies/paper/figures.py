"""The figures of the paper by number, those of controls, and the single realizations that they show."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from flockesc_env import simulate, simulate_line
from flockesc_env.common.errors import InputError
from flockesc_env.common.stats import CONFIDENCE, Estimate, FloatArray, argmax, mean, mean_with_interval
from flockesc_env.jobs import Arrays
from flockesc_env.models.graph import component_labels
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario.line import EscapeForce
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES
from studies.measurements import Runner, means
from studies.paper import plan
from studies.paper.flock_claims import PRINTED_BEST, PRINTED_COMPONENTS, dominates, gain_of_100
from studies.paper.line_claims import PRINTED_CLUSTERS, clusters
from studies.paper.mechanism_claims import flock_values
from studies.paper.plan import FLOCK, FORCES, LINE, NO_FORCE, OFFSETS, PAPER_FORCE, PAPER_OBJECTIVES
from studies.style import caption, cluster_colors, component_colors, curve, letter, subplots
from training.figure_style import BAND, RANGES, draw_predator, label_ends, save_figure

Measured = Mapping[str, Arrays]

_FORCES: dict[EscapeForce, tuple[str, str, tuple[float, float]]] = {
    "constant": ("Eq. 8 (constant)", LIGHT.others[1], (0.01, 1.8)),
    "linear": ("Eq. 9 as simulated (linear)", LIGHT.fixed, (0.102, -0.04)),
    "linear_as_printed": ("Eq. 9 as printed", LIGHT.others[2], (0.125, 0.31)),
}
"""Name, color, and place of the name in Figure 2: beside the line, the last two in the inset."""

_SHOWN_STEPS = 14
_LINE_GRID, _GRID, _AIMED = map(np.array, (plan.LINE_GRID, plan.FLOCK_GRID, plan.AIMED_GRID))

_TIMES = (0.0, 4.0, 8.0, 12.0)
_COLORS = {rho: to_hex(RANGES(min(rho / 20.0, 1.0))) for rho in plan.SHOWN_FLOCK_RANGES}
"""Colors of the ranges; the scale ends at 20 m, as on the page."""
_TICKS = (0, 2, 5, 10, 20, 50, 100)
_STRONGEST = to_hex(RANGES(0.95))
_FORCE_COLORS = {NO_FORCE: LIGHT.accent, 1.0: LIGHT.alone, PAPER_FORCE: LIGHT.fixed, 100.0: _STRONGEST}


def escape_forces() -> Figure:
    """Figure 2: what one step adds to a lone agent, against its offset from the predator."""
    figure, axes = subplots(3.8)
    inset = axes.inset_axes((0.53, 0.07, 0.45, 0.36))
    assert LINE.predator_position is not None  # noqa: S101, the paper's line has one
    offsets = np.linspace(-0.4, 0.4, 801)
    for force, (name, color, place) in _FORCES.items():
        scenario = LINE.replace(num_agents=len(offsets), escape_force=force, max_steps=1)
        start = LINE.predator_position + offsets
        moved = simulate_line(scenario, 0.0, initial_state=start).states[-1] - start
        is_jump = np.abs(np.diff(moved)) > 0.05
        drawn = np.where(np.append(is_jump, [False]), np.nan, moved)
        for panel in (axes, inset):
            panel.plot(offsets, drawn, color=color, lw=1.8)
        (axes if force == "constant" else inset).text(*place, name, color=color)
    axes.axhline(0, color=LIGHT.ink, lw=0.6)
    strength, reach = LINE.repulsion_strength, LINE.predator_range
    for panel in (axes, inset):
        panel.axvspan(-reach, reach, color=LIGHT.predator, alpha=0.1, lw=0)
    inset.set(xlim=(0.1, 0.22), ylim=(-0.1, 0.5))
    axes.indicate_inset_zoom(inset, edgecolor=LIGHT.muted)
    axes.set(xlabel="offset from the predator, x - x_p", ylabel="escape force")
    axes.margins(x=0)
    axes.set_title(f"Escape forces, s = {strength:g}; shaded: predator range {reach:g}")
    return figure


def lines_over_time(seed: int, *, is_attacked: bool) -> Figure:
    """Figures 3 and 4: one line under four ranges, without and with the predator."""
    scenario = LINE if is_attacked else plan.FREE_LINE
    place, reach = scenario.predator_position, scenario.predator_range
    figure, panels = subplots(5.6, 2, 2, sharex=True, sharey=True)
    for index, (axes, rho) in enumerate(zip(panels.flat, plan.SHOWN_RANGES, strict=True)):
        run = simulate_line(scenario, rho, seed=seed)
        steps = np.minimum(np.arange(_SHOWN_STEPS + 1), run.steps)
        colors = cluster_colors(run.states[-1], rho)
        for states, color in zip(run.states[steps].T, colors, strict=True):
            axes.plot(states, color=color, lw=0.7)
        axes.margins(x=0)
        number = int(run.num_components[-1])
        title = f"range {rho:g}: {number} cluster{'' if number == 1 else 's'}"
        if place is not None:
            axes.axhspan(place - reach, place + reach, color=LIGHT.predator, alpha=0.1, lw=0)
            axes.plot(0, place, "o", color=LIGHT.predator, clip_on=False, zorder=3)
            title += f", d_ss = {run.escape_distance[-1]:.2f}"
        letter(axes, index, title)
    for axes in panels[-1]:
        axes.set_xlabel("time (steps)")
    for axes in panels[:, 0]:
        axes.set_ylabel("state x")
    kind = "under attack (vermilion: predator and its range)" if is_attacked else "without predator"
    caption(figure, f"Line of seed {seed} {kind}; color: cluster")
    return figure


def distance_against_range(measured: Measured) -> Figure:
    """Figure 5: mean steady-state distance and mean number of clusters against the range, by escape force."""
    figure, panels = subplots(5.2, 2, len(FORCES), sharex=True, squeeze=False)
    for column, force in enumerate(FORCES):
        grid = measured[f"grid {force}"]
        above, below = panels[:, column]
        center, low, high = mean_with_interval(grid["escape_distance"], CONFIDENCE)
        above.fill_between(_LINE_GRID, low, high, color=BAND, lw=0)
        best = int(np.argmax(center))
        number: FloatArray = grid["num_components"].mean(axis=1)
        below.set_yscale("log")
        for axes, values, printed in ((above, center, 0.3), (below, number, 2.65)):
            axes.plot(_LINE_GRID, values, color=LIGHT.fixed, lw=1)
            axes.plot(_LINE_GRID[plan.COARSE], values[plan.COARSE], "o", color=LIGHT.fixed, ms=4)
            axes.plot(0.1, printed, "x", color=LIGHT.accent, ms=8, mew=2)
        above.plot(_LINE_GRID[best], center[best], "v", color=LIGHT.learned, ms=8)
        at = (_LINE_GRID[best], center[best])
        above.annotate(f"{at[0]:.2f}", at, (6, 6), textcoords="offset points", color=LIGHT.learned)
        above.margins(y=0.15)
        letter(above, column, _FORCES[force][0])
        below.set_xlabel("interaction range")
    panels[0, 0].set_ylabel("mean distance d_ss")
    panels[1, 0].set_ylabel("mean number of clusters")
    lines = grid["escape_distance"].shape[1]
    text = f"{lines:,} lines a point, 95 % band; dots: the paper's grid, triangle: maximum, cross: the paper"
    caption(figure, text, size=9.5)
    return figure


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


def distances(objective: str, measured: Measured, seed: int) -> Figure:
    """Figures 9 and 10: distance against time, objective against range, and the best ranges of flocks."""
    spec = FLOCK_OBJECTIVES[objective]
    values = measured["grid flock"][spec.name]
    best = argmax(_GRID, values)
    figure, (over_time, over_range, histogram) = subplots(3.5, 1, 3)
    times, ends = np.arange(FLOCK.num_steps + 1) * FLOCK.time_step, []
    for flocks, (rho, color) in zip(measured["curves"][spec.series], _COLORS.items(), strict=True):
        over_time.plot(times, flocks[seed], color=color, lw=1.5)
        over_time.plot(times, flocks.mean(axis=0), color=color, ls=":", lw=1.2)
        ends.append((float(flocks[seed][-1]), f"{rho:g} m", color))
    over_time.set(xlabel="time (s)", ylabel=spec.with_unit(spec.label))
    over_time.margins(x=0)
    label_ends(over_time, ends)
    center, low, high = mean_with_interval(values, CONFIDENCE)
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


def aimed_beside(measured: Measured) -> Figure:
    """Draw the best range, and 100 m minus 10 m, against the predator's distance from the center."""
    figure, panels = subplots(5.6, 2, 2, sharex=True)
    for column, spec in enumerate(PAPER_OBJECTIVES):
        symbol, (above, below) = spec.symbol, panels[:, column]
        values = [measured[f"aimed {offset:g}"][spec.name] for offset in OFFSETS]
        _points(above, [argmax(_AIMED, rows) for rows in values])
        _points(below, [mean(gain_of_100(rows)) for rows in values])
        above.set(ylim=(0, 105))
        letter(above, column, f"{symbol}: best range in expectation")
        below.axhline(0, color=LIGHT.ink, lw=0.8)
        below.set(xlabel="the predator's path misses the center by (m)")
        letter(below, 2 + column, f"{symbol} at 100 m minus {symbol} at 10 m")
    panels[0, 0].set_ylabel("interaction range (m)")
    panels[1, 0].set_ylabel("difference (m)")
    caption(figure, f"An attack beside the center: {values[0].shape[1]:,} flocks a point, 95 % intervals")
    return figure


def _points(axes: Axes, estimates: list[Estimate]) -> None:
    """Draw an estimate with its interval at every offset."""
    means, below, above = zip(*((e.mean, e.mean - e.low, e.high - e.mean) for e in estimates), strict=True)
    axes.errorbar(OFFSETS, means, (below, above), fmt="o", ms=5, lw=1.5, color=LIGHT.fixed)


def by_force(results: Measured) -> Figure:
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


def line_seed(measured: Measured) -> int:
    """Return the seed of the line in Figures 3 and 4, by the rule on the page."""
    finals = measured["free line"]["final"]

    def deviation(seed: int) -> float:
        worst = 0.0
        for rho, printed in PRINTED_CLUSTERS.items():
            found = clusters(finals[plan.FREE_RANGES.index(rho), seed], rho)
            if len(found) != len(printed):
                return np.inf
            worst = max(worst, float(np.abs(found - printed).max()))
        return worst

    return int(np.argmin([deviation(seed) for seed in range(finals.shape[1])]))


def flock_seed(measured: Measured) -> int:
    """Return the seed of the flock in Figures 6 to 10, by the rule on the page."""
    curves, values = measured["curves"], measured["grid flock"]["min_mean_distance"]
    at_end = curves["num_components"][plan.SHOWN_FLOCK_RANGES.index(PRINTED_BEST), :, -1]
    suits = (at_end == PRINTED_COMPONENTS) & dominates(curves["mean_distance"]).all(axis=-1)
    best = _GRID[np.argmax(values, axis=0)]
    return int(np.argmin(np.where(suits | ~suits.any(), np.abs(best - PRINTED_BEST), np.inf)))


_FLOCKS = ("curves", "grid flock")
_CONTROLS = [
    plan.control(plan.PAPER, force, kind) for kind in ("control", "captures") for force in plan.STRENGTHS
]

FIGURES: Final[dict[str, tuple[Iterable[str], Callable[[Measured], Figure]]]] = {
    "2": ((), lambda _: escape_forces()),
    "3": (("free line",), lambda m: lines_over_time(line_seed(m), is_attacked=False)),
    "4": (("free line",), lambda m: lines_over_time(line_seed(m), is_attacked=True)),
    "5": ([f"grid {force}" for force in FORCES], distance_against_range),
    "6": (_FLOCKS, lambda m: snapshots(flock_seed(m), 100.0)),
    "7": (_FLOCKS, lambda m: snapshots(flock_seed(m), 10.0)),
    "8": (_FLOCKS, lambda m: snapshots(flock_seed(m), 0.0)),
    "9": (_FLOCKS, lambda m: distances("min_mean_distance", m, flock_seed(m))),
    "10": (_FLOCKS, lambda m: distances("min_min_distance", m, flock_seed(m))),
    "edge": ([f"aimed {offset:g}" for offset in plan.OFFSETS], aimed_beside),
    "force": (_CONTROLS, by_force),
}
"""Measurements that a figure needs and how it is drawn, by the number in the paper. ``"edge"`` is the attack
beside the center, ``"force"`` a control of the paper's explanation."""


def draw_figures(output: Path, measured: Measured, names: Iterable[str] = FIGURES) -> list[Path]:
    """Write figures of finished measurements; return their files."""
    stems = {name: f"figure_{name}" if name.isdigit() else name for name in names}
    return [save_figure(FIGURES[name][1](measured), output / f"{stem}.png") for name, stem in stems.items()]


def measure_and_draw(runner: Runner, output: Path, names: Iterable[str], trials: plan.Trials) -> list[Path]:
    """Write some figures after the measurements that they need; return their files."""
    for name in names:
        if name not in FIGURES:
            raise InputError("figures", f"some of {', '.join(FIGURES)}", repr(name))
    known = plan.measurements(trials)
    needed = {need: known[need] for name in names for need in FIGURES[name][0]}
    return draw_figures(output, runner.run(needed, "Measuring"), names)
