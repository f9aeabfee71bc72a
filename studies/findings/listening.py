"""Ranges that a policy sets: by the predator's place, and over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario
from flockesc_env.common.array_files import read_npz, write_npz
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from studies.findings.controls import watch
from studies.findings.headlines import Headline
from studies.measurements import Runner, policy_of, share_of
from studies.style import subplots
from training.figure_style import RANGES

FLOCKS: Final = 50
WATCHED: Final = ("per-agent-local", "per-agent-visible")
"""Tasks with a picture of the ranges that their headline policy sets; every agent sets its own."""

SILENT: Final = 1.0  # range in m below which an agent does not listen: it hardly ever has a neighbor

_HEADINGS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Labelled cosines between an agent's heading and the direction away from the predator."""

_QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.9)


def listen(policy: bytes, flocks: range) -> Arrays:
    """Run a policy with one range per agent on flocks of its own scenario.

    Returns:
        ``times`` of the actions in s; ``quantiles`` of the ranges in m at every action, shape (5, actions);
        ``silent``, the share of agents below ``SILENT``; ``range_by_place``, the mean range in m by cosine
        between heading and the direction away from the predator (edges ``cosines``) and by predator distance
        in m (edges ``distances``), where it is sensed; NaN in cells without agents.
    """
    entry = policy_of(policy)
    watched = watch(entry, flocks)
    ranges, scenario = watched.ranges, entry.scenario
    assert isinstance(scenario, FlockScenario)  # noqa: S101, only flocks have agents that sense a predator
    is_sensed = watched.entry("predator_sensed") > 0
    scaled = watched.entry("predator_distance")[is_sensed]
    distance = scenario.initial_side * scaled / (1 - scaled)
    cosine = -watched.entry("predator_direction_ahead")[is_sensed]
    cosines, distances = np.linspace(-1, 1, 21), np.linspace(0, np.quantile(distance, 0.98), 25)
    sums, _, _ = np.histogram2d(cosine, distance, (cosines, distances), weights=ranges[is_sensed])
    counts, _, _ = np.histogram2d(cosine, distance, (cosines, distances))
    return {
        "times": np.arange(len(ranges)) * entry.policy_spec.options.steps_per_action * scenario.time_step,
        "quantiles": np.quantile(ranges, _QUANTILES, axis=1),
        "silent": (ranges < SILENT).mean(axis=1),
        "range_by_place": np.where(counts > 0, sums / np.maximum(counts, 1), np.nan),
        "cosines": cosines,
        "distances": distances,
    }


def measure(headlines: Sequence[Headline], scale: float, runner: Runner, output: Path) -> None:
    """Write what ``listen`` returns for the headline policies of ``WATCHED``, a file per task."""
    flocks = share_of(HELD_OUT, FLOCKS, scale)
    jobs = {
        headline.task.name: Job(f"{__name__}:listen", (headline.content, flocks), len(flocks) * 0.1)
        for headline in headlines
        if headline.task.name in WATCHED
    }
    for name, kept in runner.run(jobs, "Listening").items():
        write_npz(output / f"{name}.npz", kept)


class Silence(NamedTuple):
    """Mean range in m of agents that head toward the predator, and the share of actions without listening."""

    range_toward: float
    silent: float


def silence(file: Path) -> Silence:
    """Return who listens, of agents that see the predator.

    Agents toward it head more than 120 degrees off the direction away from it, over the cells of the figure.
    """
    kept = read_npz(file, "ranges")
    toward = kept["range_by_place"][kept["cosines"][1:] <= -0.5 + 1e-9]
    return Silence(float(np.nanmean(toward)), float(kept["silent"].mean()))


def figure(file: Path, *, by_place: bool) -> Figure:
    """Draw the mean range by predator distance and heading, or the ranges of the agents against time."""
    kept = read_npz(file, "ranges")
    figure, axes = subplots(3.6)
    if by_place:
        mean, top = kept["range_by_place"], float(np.nanmax(kept["range_by_place"]))
        mesh = axes.pcolormesh(kept["distances"], kept["cosines"], mean, cmap=RANGES, vmin=0, vmax=top)
        figure.colorbar(mesh, ax=axes, label="mean interaction range (m)")
        axes.set_title("Range by the agent's place and heading, predator always visible")
        axes.set(xlabel="distance to the predator (m)", ylabel="heading relative to the predator")
        axes.set_yticks(_HEADINGS, ["toward it", "120° off", "90° off", "60° off", "away from it"])
        return figure
    times = kept["times"]
    low, _, median, _, high = kept["quantiles"]
    edges = np.append(times, 2 * times[-1] - times[-2])
    axes.stairs(high, edges, baseline=low, fill=True, color=LIGHT.learned, alpha=0.2, lw=0)
    axes.stairs(median, edges, baseline=None, color=LIGHT.learned, lw=2)
    axes.set_title("Range over time, predator visible within 30 m: median, and 10 to 90 % of the agents")
    axes.set(xlabel="time (s)", ylabel="interaction range (m)", xlim=(0, edges[-1]), ylim=(0, None))
    return figure
