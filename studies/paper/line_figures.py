"""Figures 2 to 5: the line."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flockesc_env.common.stats import FloatArray
from flockesc_env.jobs import Arrays
from flockesc_env.models.simulate import simulate_line
from flockesc_env.models.sweep import LineSweepResult
from flockesc_env.scenario.flock import EscapeForce, LineScenario
from studies.paper.plan import COARSE, FORCES, FREE_LINE, LINE, LINE_GRID, SHOWN_RANGES
from studies.style import BAND, INK, PREDATOR, cluster_colors, letter

_NAMES: dict[EscapeForce, str] = {
    "constant": "constant (Eq. 8)",
    "linear": "linear (as simulated)",
    "linear_as_printed": "linear_as_printed (Eq. 9)",
}
_SHOWN_STEPS = 14
_GRID = np.array(LINE_GRID)


def escape_forces() -> Figure:
    """Figure 2: what one step adds to a lone agent, against its offset from the predator."""
    figure = Figure(figsize=(7, 3.6), layout="constrained")
    axes = figure.subplots()
    assert LINE.predator_position is not None  # noqa: S101, the paper's line has one
    offsets = np.linspace(-0.4, 0.4, 801)
    for force, name in _NAMES.items():
        scenario = LINE.replace(num_agents=len(offsets), escape_force=force, max_steps=1)
        start = LINE.predator_position + offsets
        moved = simulate_line(scenario, 0.0, initial_state=start).states[-1] - start
        is_jump = np.abs(np.diff(moved)) > 0.05
        axes.plot(offsets, np.where(np.append(is_jump, [False]), np.nan, moved), label=name)
    axes.axhline(0, color=INK, lw=0.6)
    axes.axvspan(-LINE.predator_range, LINE.predator_range, color=PREDATOR, alpha=0.08, lw=0)
    axes.set(xlabel="offset x - x_p", ylabel="escape force")
    axes.set_title(
        f"Escape forces, s = {LINE.repulsion_strength:g}, rho_p = {LINE.predator_range:g} (shaded)"
    )
    axes.legend(frameon=False, fontsize=8)
    return figure


def lines_over_time(seed: int, *, is_attacked: bool) -> Figure:
    """Figures 3 and 4: one line under four ranges, without and with the predator."""
    scenario = LINE if is_attacked else FREE_LINE
    figure = Figure(figsize=(9, 6.2), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    for index, (axes, rho) in enumerate(zip(panels.flat, SHOWN_RANGES, strict=True)):
        _line(axes, scenario, rho, seed)
        letter(axes, index)
    for axes in panels[-1]:
        axes.set_xlabel("t (steps)")
    for axes in panels[:, 0]:
        axes.set_ylabel("x")
    kind = "under attack (red: predator and its range)" if is_attacked else "without predator"
    figure.suptitle(f"Line of seed {seed} {kind}")
    return figure


def _line(axes: Axes, scenario: LineScenario, rho: float, seed: int) -> None:
    run = simulate_line(scenario, rho, seed=seed)
    steps = np.minimum(np.arange(_SHOWN_STEPS + 1), run.steps)
    final = run.states[-1]
    for states, color in zip(run.states[steps].T, cluster_colors(final, rho), strict=True):
        axes.plot(states, color=color, lw=0.7)
    number = int(run.num_components[-1])
    title = f"rho = {rho:g}: {number} cluster{'' if number == 1 else 's'}"
    if scenario.predator_position is not None:
        reach = scenario.predator_range
        axes.axhspan(
            scenario.predator_position - reach,
            scenario.predator_position + reach,
            color=PREDATOR,
            alpha=0.08,
            lw=0,
        )
        axes.plot(0, scenario.predator_position, "o", color=PREDATOR, clip_on=False, zorder=3)
        title += f", d_ss = {run.escape_distance[-1]:.2f}"
    axes.set_title(title, fontsize=10)
    axes.margins(x=0)


def distance_against_range(grids: dict[EscapeForce, Arrays]) -> Figure:
    """Figure 5: mean steady-state distance and mean number of clusters against the range, by escape force."""
    figure = Figure(figsize=(11, 6.4), layout="constrained")
    panels = figure.subplots(2, len(FORCES), sharex=True, squeeze=False)
    for column, force in enumerate(FORCES):
        grid = grids[force]
        above, below = panels[:, column]
        result = _result(force, grid)
        center, low, high = result.mean_with_interval()
        axes: Axes = above
        axes.fill_between(_GRID, low, high, color=BAND, lw=0)
        axes.plot(_GRID, center, color="tab:blue", lw=1, label="grid of 0.01")
        axes.plot(_GRID[COARSE], center[COARSE], "o", color=INK, ms=4, label="the paper's grid")
        best = int(np.argmax(center))
        axes.plot(
            _GRID[best], center[best], "v", color="tab:orange", ms=7, label=f"maximum, at {_GRID[best]:.2f}"
        )
        axes.plot(0.1, 0.3, "x", color=PREDATOR, ms=8, mew=2, label="the paper's maximum")
        axes.set_title(_NAMES[force], fontsize=10)
        axes.legend(frameon=False, fontsize=8)
        letter(axes, column)
        clusters: FloatArray = grid["num_components"].mean(axis=1)
        below.semilogy(_GRID, clusters, color="tab:blue", lw=1)
        below.plot(_GRID[COARSE], clusters[COARSE], "o", color=INK, ms=4)
        below.plot(0.1, 2.65, "x", color=PREDATOR, ms=8, mew=2)
        below.set_xlabel("rho")
    panels[0, 0].set_ylabel("mean steady-state escape distance")
    panels[1, 0].set_ylabel("mean number of clusters")
    lines = next(iter(grids.values()))["escape_distance"].shape[1]
    figure.suptitle(f"{lines:,} lines a point, band: 95 % interval")
    return figure


def _result(force: EscapeForce, grid: Arrays) -> LineSweepResult:
    seeds = np.arange(grid["escape_distance"].shape[1], dtype=np.uint64)
    return LineSweepResult(LINE.replace(escape_force=force), _GRID, seeds, **grid)
