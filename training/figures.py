"""``python -m training figures``: ``flockesc compare`` with figures and recorded runs."""

import json
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flockesc_env import FlockScenario, InputError, load_policy, save_run, simulate
from flockesc_env.common.array_files import origin, write_table
from flockesc_env.common.files import check_writable, write_text
from flockesc_env.models import Trajectory
from flockesc_env.models.records import versions
from flockesc_env.policies import BasePolicy
from flockesc_env.render.frames import policy_title
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario.objectives import ObjectiveSpec
from flockesc_env.taskset import Task
from training.figure_style import RANGES, WIDTH, draw_predator, save_figure

RECORDS = ("best_fixed_range.npz", "last_policy.npz")
"""Recorded runs of one flock, for ``flockesc watch``."""

_COLORS = (LIGHT.fixed, LIGHT.learned)
"""Colors of the best fixed range and of the policy that is compared with it."""

_TIMES = (0, 3, 6, 9)  # s of the pictures of a flock under attack


def draw(task: Task, entries: Sequence[BasePolicy], output: Path, num_flocks: int) -> None:
    """Compare policies on held-out flocks; print the table, write it, figures and two recorded runs.

    Raises:
        InputError: if there is no policy, one does not fit the task, or the task is a line.
    """
    if not entries or not isinstance(task.scenario, FlockScenario):
        raise InputError("policies", "policies for a flock", f"{len(entries)} for {task.name}")
    output.mkdir(parents=True, exist_ok=True)
    check_writable(output / "table.md")
    found = task.compare(*entries, num_flocks=num_flocks)
    print(found)
    found.write(output)
    write_table(found.search.table(), output / "grid_search.parquet", origin(found.search))
    record = {"command": shlex.join(["python", "-m", "training", *sys.argv[1:]]), "versions": versions()}
    write_text(output / "comparison.json", json.dumps(record, indent=2) + "\n")

    (fixed_name, fixed), last = next(iter(found.values.items())), entries[-1]
    best = load_policy(f"fixed:{task.scales[found.scenario].best_fixed_range:g}")
    # A typical flock: the lower median of the last policy's paired differences to the best range.
    order = np.argsort([*found.values.values()][-1] - fixed, kind="stable")
    flock = int(found.seeds[order[(len(order) - 1) // 2]])
    scenario = task.scenarios[found.scenario]
    shown = ((fixed_name, best), (last.name, last))
    runs = [(name, simulate(cast("FlockScenario", scenario), policy=one, seed=flock)) for name, one in shown]
    for file, (name, run) in zip(RECORDS, runs, strict=True):
        save_run(run, output / file, name=name)
    figures = [
        save_figure(found.plot(), output / "objective_against_range.png"),
        flock_under_attack(runs, task.spec, output),
    ]
    print("\nFigures:", *figures, sep="\n  ")
    files = [str(output / file) for file in RECORDS]
    program = os.path.relpath(Path(sys.executable).with_name("flockesc"))
    print("\nWatch this flock in the browser:", shlex.join([program, "watch", *files]), sep="\n  ")


def _title(name: str, place: int) -> str:
    """Return the title of a policy; the second one is learned, and its run's name says nothing to others."""
    title = policy_title(name)
    return "learned policy" if place and title == name else title


def flock_under_attack(runs: list[tuple[str, Trajectory]], objective: ObjectiveSpec, folder: Path) -> Path:
    """Draw one flock at some times, a row per policy, agents colored by their range; return the file."""
    top = max(float(run.interaction_ranges.max()) for _, run in runs)
    scenario = runs[0][1].scenario
    steps = [min(round(time / scenario.time_step), scenario.num_steps - 1) for time in _TIMES]
    low, high = _frame([(run, step) for _, run in runs for step in steps])
    width = (WIDTH - 1.4) / len(_TIMES)
    height = width * (high[1] - low[1]) / (high[0] - low[0])
    figure = Figure(figsize=(WIDTH, (height + 0.75) * len(runs) + 0.2), layout="constrained")
    parts = figure.subfigures(len(runs), 1, squeeze=False)[:, 0]
    baseline = getattr(runs[0][1], objective.series).min()
    arrows: Any = None
    for place, (part, (name, trajectory)) in enumerate(zip(parts, runs, strict=True)):
        reached = getattr(trajectory, objective.series).min()
        gain = f", gain {objective.text(reached - baseline, '+')}" if place else ""
        part.suptitle(
            f"{_title(name, place)}: {objective.symbol} {objective.text(reached)}{gain}",
            x=0.01,
            ha="left",
            color=_COLORS[place],
            fontweight="bold",
        )
        panels = part.subplots(1, len(_TIMES), sharex=True, sharey=True, squeeze=False)[0]
        for axes, step in zip(panels, steps, strict=True):
            arrows = _snapshot(axes, trajectory, step, top)
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
            if place:
                axes.set_xlabel("x (m)")
        panels[0].set_ylabel("y (m)")
        part.colorbar(arrows, ax=list(panels), label="range (m)", aspect=12, ticks=np.linspace(0, top, 5))
    return save_figure(figure, folder / "flock_under_attack.png")


def _frame(shown: list[tuple[Trajectory, int]]) -> tuple[Any, Any]:
    """Return the corners of a box around agents and predator ranges at some steps of runs, with a margin."""
    corners = []
    for run, step in shown:
        reach, predators = run.scenario.predator_range, run.predator_positions[step, :, :2]
        corners += [run.positions[step, :, :2], predators - reach, predators + reach]
    seen = np.concatenate(corners)
    return seen.min(axis=0) - 15, seen.max(axis=0) + 15


def _snapshot(axes: Axes, trajectory: Trajectory, step: int, top: float) -> Any:
    positions, velocities = trajectory.positions[step, :, :2], trajectory.velocities[step, :, :2]
    colors = np.broadcast_to(trajectory.interaction_ranges[step], len(positions))
    for path in trajectory.predator_positions[: step + 1, :, :2].swapaxes(0, 1):
        draw_predator(axes, path, trajectory.scenario.predator_range)
    arrows = axes.quiver(
        *positions.T, *velocities.T, colors, cmap=RANGES, clim=(0, top), scale=220, width=0.009, headwidth=4
    )
    axes.set_aspect("equal")
    axes.set_title(f"{trajectory.times[step]:.0f} s: {trajectory.mean_distance[step]:.0f} m away", fontsize=9)
    return arrows
