"""Ranges that a policy sets: by the predator's place, or over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flockesc_env import FlockScenario, NamedPolicy
from flockesc_env.common.array_files import write_npz
from flockesc_env.episodes.splits import HELD_OUT, first_seeds
from flockesc_env.render.palette import LIGHT
from studies.findings.watching import watch
from training.figure_style import RANGES, WIDTH

SILENT = 1.0
"""Range in m below which an agent does not listen: it hardly ever has a neighbor."""

_HEADINGS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Labelled cosines between an agent's heading and the direction away from the predator."""

_QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.9)
LISTENING_FILE = "listening.npz"
LISTENING_FLOCKS = 50
WATCHED = ("per-agent-local", "per-agent-visible")
"""Settings with a picture of the ranges that their headline policy sets."""


def measure_listening(entry: NamedPolicy, path: Path) -> None:
    """Run a policy on held-out flocks of its own scenario and save the statistics for the figure.

    - ``times``: of the actions, in s;
    - ``quantiles``: of the ranges in m at every action, shape (5, actions); ``silent``: share of agents below
      ``SILENT``;
    - with one range per agent ``range_by_place``: mean range in m by cosine between heading and the
      direction away from the predator (edges ``cosines``) and by predator distance in m (``distances``),
      where it is sensed; NaN in cells without agents;
    - ``stopped``: share of agents that never listen again from this action on, by thirds of the agents in
      order of their predator distance at the start, shape (3, actions). One row for all agents if they do
      not see the predator at the start.
    """
    flocks = first_seeds(HELD_OUT, LISTENING_FLOCKS)
    layout, seen, ranges = watch(entry, flocks)
    scenario = entry.scenario
    assert isinstance(scenario, FlockScenario)  # noqa: S101, only flocks have this figure
    times = np.arange(len(ranges)) * entry.options["steps_per_action"] * scenario.time_step
    found: dict[str, NDArray[Any]] = {
        "times": times,
        "quantiles": np.quantile(ranges, _QUANTILES, axis=1),
        "silent": (ranges < SILENT).mean(axis=1),
    }
    if entry.per_agent:
        side = scenario.initial_side
        sensed = seen[..., layout.index("predator_sensed")] > 0
        scaled = seen[..., layout.index("predator_distance")].astype(np.float64)
        distance = side * scaled / (1 - scaled)
        cosine = -seen[..., layout.index("predator_direction_ahead")]
        edges = np.linspace(-1, 1, 21), np.linspace(0, np.quantile(distance[sensed], 0.98), 25)
        sums, _, _ = np.histogram2d(cosine[sensed], distance[sensed], edges, weights=ranges[sensed])
        counts, _, _ = np.histogram2d(cosine[sensed], distance[sensed], edges)
        found["range_by_place"] = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
        found["cosines"], found["distances"] = edges
        agents = ranges.reshape(len(ranges), len(flocks), -1)
        last = np.max(np.where(agents >= SILENT, np.arange(len(agents))[:, None, None] + 1, 0), axis=0)
        start = distance[0].reshape(agents.shape[1:]) if sensed[0].all() else None
        thirds = [np.ones_like(last, bool)] if start is None else _thirds(start)
        found["stopped"] = np.array(
            [[(last[third] <= action).mean() for action in range(len(agents))] for third in thirds]
        )
    write_npz(path, found)


def _thirds(start: NDArray[np.float64]) -> list[NDArray[np.bool]]:
    ranks = start.argsort(axis=1).argsort(axis=1) * 3 // start.shape[1]
    return [ranks == third for third in range(3)]


def draw_listening(source: Path) -> Figure:
    """Draw the statistics in a file of ``measure_listening``.

    If every agent sees the predator at the start: the mean range by predator distance and heading. Otherwise:
    the ranges of the agents against time.
    """
    with np.load(source, allow_pickle=False) as file:
        kept = {name: file[name] for name in file.files}
    figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    axes = figure.subplots()
    if "range_by_place" in kept and len(kept["stopped"]) == 3:
        _by_place(figure, axes, kept)
    else:
        _over_time(axes, kept)
    return figure


def _by_place(figure: Figure, axes: Axes, kept: dict[str, NDArray[Any]]) -> None:
    top = float(np.nanmax(kept["range_by_place"]))
    mesh = axes.pcolormesh(
        kept["distances"], kept["cosines"], kept["range_by_place"], cmap=RANGES, vmin=0, vmax=top
    )
    figure.colorbar(mesh, ax=axes, label="mean interaction range (m)")
    axes.set_title("Range by the agent's place and heading, predator always visible")
    axes.set(xlabel="distance to the predator (m)", ylabel="heading relative to the predator")
    axes.set_yticks(_HEADINGS, ["toward it", "120° off", "90° off", "60° off", "away from it"])


def _over_time(axes: Axes, kept: dict[str, NDArray[Any]]) -> None:
    times = kept["times"]
    edges = np.append(times, 2 * times[-1] - times[-2])
    low, _, median, _, high = kept["quantiles"]
    axes.stairs(high, edges, baseline=low, fill=True, color=LIGHT.learned, alpha=0.2, lw=0)
    axes.stairs(median, edges, baseline=None, color=LIGHT.learned, lw=2)
    axes.set_title("Range over time, predator visible within 30 m: median, and 10 to 90 % of the agents")
    axes.set(xlabel="time (s)", ylabel="interaction range (m)", xlim=(0, edges[-1]), ylim=(0, None))
