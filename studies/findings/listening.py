"""Ranges that policies set: by the predator's place, over time, and those of one agent that waits."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flockesc_env import FlockScenario, load_policy
from flockesc_env.common.array_files import read_npz, write_npz
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.splits import HELD_OUT, first_seeds
from flockesc_env.jobs import Arrays, Job
from flockesc_env.policies import BasePolicy
from flockesc_env.render.frames import SILENT
from flockesc_env.render.palette import LIGHT
from studies.findings.controls import watch
from studies.findings.headlines import Headline
from studies.measurements import Runner, policy_of, share_of
from studies.style import subplots
from training.figure_style import RANGES, label_ends

FLOCKS: Final = 50
WATCHED: Final = ("per-agent-local", "per-agent-visible")
"""Tasks with a picture of the ranges that their headline policy sets; every agent sets its own."""

_HEADINGS = {1.0: "away from it", 0.5: "60° off", 0.0: "90° off", -0.5: "120° off", -1.0: "toward it"}
"""Labels of cosines between an agent's heading and the direction away from the predator."""

_QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.9)

ONE_AGENT: Final = "one_agent.npz"
CANDIDATES: Final = (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0)
"""Ranges in m whose heard velocity the figure shows. They are also those of the rule."""

BLIND: Final = "per-agent-visible-derived"
_TITLES = {"blind": "Without a profile: the best policy", "informed": "With a profile: the rule turn-away"}
_AHEAD = 30.0  # degrees off its escape direction within which an agent counts as escaping
_SHOWN = 2.0  # seconds of the figure


def listen(policy: bytes, flocks: range) -> Arrays:
    """Run a policy, the content of its file, with one range per agent, on seeds of its own scenario.

    Returns:
        ``times`` of the actions in s; ``quantiles`` of the ranges in m at every action, shape (5, actions);
        ``silent``, the share of agents below ``SILENT``; ``range_by_place``, the mean range in m by cosine
        between heading and the direction away from the predator (edges ``cosines``) and by predator distance
        in m (edges ``distances``), where it is sensed; NaN in cells without agents.
    """
    entry = policy_of(policy)
    watched = watch(entry, flocks)
    ranges, scenario = np.array(watched.ranges), entry.scenario
    assert isinstance(scenario, FlockScenario)  # noqa: S101, only flocks have agents that sense a predator
    is_sensed = watched.entry("predator_sensed") > 0
    scaled = watched.entry("predator_distance")[is_sensed]
    distance = scenario.initial_side * scaled / (1 - scaled)  # an observation shows d / (d + side)
    # The entry is the cosine to the predator; few agents are beyond the 0.98 quantile.
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
    """Write files of what ``listen`` returns for the tasks of ``WATCHED``, and ``follow`` for ``BLIND``."""
    flocks, jobs = share_of(HELD_OUT, FLOCKS, scale), {}
    for one in headlines:
        if one.task.name in WATCHED:
            arguments = (one.content, flocks)
            jobs[f"{one.task.name}.npz"] = Job(f"{__name__}:listen", arguments, len(flocks) * 0.1)
        elif one.task.name == BLIND:
            jobs[ONE_AGENT] = Job(f"{__name__}:follow", (one.content,))
    for file, kept in runner.run(jobs, "Listening").items():
        write_npz(output / file, kept)


def silence(file: Path) -> tuple[float, float]:
    """Return the mean range in m of agents that head toward the predator, and the share of silent actions.

    Agents toward it head more than 120 degrees off the direction away from it, over the cells of the figure.
    """
    kept = read_npz(file, "ranges")
    toward = kept["range_by_place"][kept["cosines"][1:] <= -0.5 + 1e-9]
    return float(np.nanmean(toward)), float(kept["silent"].mean())


def ranges_figure(file: Path, *, by_place: bool) -> Figure:
    """Draw the mean range by predator distance and heading, or the share of agents that listen over time."""
    kept = read_npz(file, "ranges")
    figure, axes = subplots(3.6)
    if by_place:
        mean, top = kept["range_by_place"], float(np.nanmax(kept["range_by_place"]))
        mesh = axes.pcolormesh(kept["distances"], kept["cosines"], mean, cmap=RANGES, vmin=0, vmax=top)
        figure.colorbar(mesh, ax=axes, label="mean interaction range (m)")
        axes.set_title("Range by the agent's place and heading, predator always visible")
        axes.set(xlabel="distance to the predator (m)", ylabel="heading relative to the predator")
        axes.set_yticks([*_HEADINGS], _HEADINGS.values())
        return figure
    times, silent = kept["times"], 100 * kept["silent"]
    edges = np.append(times, 2 * times[-1] - times[-2])
    axes.stairs(silent, edges, fill=True, color=LIGHT.ranges[0])
    axes.stairs(np.full(len(times), 100), edges, baseline=silent, fill=True, color=LIGHT.ranges[-1])
    axes.set_title(f"Who listens, predator visible within 30 m; nobody: a range below {SILENT:g} m")
    axes.set(xlabel="time (s)", ylabel="agents (%)", xlim=(0, edges[-1]), ylim=(0, 100))
    ends = [(silent[-1] / 2, "listen to nobody"), (50 + silent[-1] / 2, "listen to others")]
    label_ends(
        axes, [(float(y), text, color) for (y, text), color in zip(ends, LIGHT.ranges[::4], strict=True)]
    )
    return figure


def follow(policy: bytes) -> Arrays:
    """Follow one agent of the first held-out flock under a policy (blind) and ``turn-away`` (informed).

    Of the agents that head more than 120 degrees off their escape direction at the start, it is the one that
    needs the median time to come within 30 degrees of it under the first policy.

    Returns:
        For each policy, with its name in front: ``times`` of its actions in s; ``own``, the agent's angle off
        the escape direction in degrees; ``heard``, that of the velocity heard within each candidate, shape
        (actions, candidates), NaN where the agent would hear nobody; ``chosen``, its ranges in m.
    """
    runs = {"blind": _run(policy_of(policy)), "informed": _run(load_policy("turn-away"), CANDIDATES[-1])}
    own = runs["blind"]["own"]
    escapes, agents = own < _AHEAD, np.flatnonzero(own[0] > 120)
    arrival = np.where(escapes.any(axis=0), escapes.argmax(axis=0), len(own))
    agent = agents[np.argsort(arrival[agents], kind="stable")][len(agents) // 2]
    return {
        f"{name}_{part}": values if part == "times" else values[:, agent]
        for name, run in runs.items()
        for part, values in run.items()
    }


def _run(policy: BasePolicy, max_range: float | None = None) -> dict[str, NDArray[Any]]:
    """Run a policy; its observation also has the profile, which the policy does not see if it is blind."""
    extra = ("escape_direction", "closest_approach")
    known = policy.policy_spec.options
    longest = max_range or known.max_range
    profile = [rho for rho in CANDIDATES if rho <= longest]
    seeing: dict[str, Any] = {"max_range": longest, "profile_ranges": profile, "extra_entries": extra}
    scenario = FlockScenario()
    watched = watch(policy.with_options(scenario=scenario, **seeing), first_seeds(HELD_OUT, 1))
    ranges = np.array(watched.ranges)
    heard = np.full((*ranges.shape, len(CANDIDATES)), np.nan)
    for k, rho in enumerate(profile):
        hears = (watched.entry(f"profile_{k}_neighbor_count") > 0) | (rho == 0)
        heard[..., k] = np.where(hears, _degrees(watched.entry(f"profile_{k}_escape_cosine")), np.nan)
    return {
        "times": np.arange(len(ranges)) * (known.steps_per_action * scenario.time_step),
        "own": _degrees(watched.entry("escape_direction_ahead")),
        "heard": heard,
        "chosen": ranges,
    }


def _degrees(cosines: FloatArray) -> FloatArray:
    angles: FloatArray = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
    return angles


def arrivals(file: Path) -> dict[str, float]:
    """Return the time in s after which the agent first heads its way, by policy."""
    kept = read_npz(file, "headings")
    return {name: float(kept[f"{name}_times"][(kept[f"{name}_own"] < _AHEAD).argmax()]) for name in _TITLES}


def largest_turn(neighbors: int) -> float:
    """Return the angle in degrees by which the consensus force can turn an agent of the paper in one step.

    With the force a v0 u along a unit vector u, steps 3 and 4 of the model turn the heading h to that of
    h + k u, where k = a dt / m < 1. The angle is at most arcsin(k), reached if u is 90 degrees + arcsin(k)
    off h. An agent also hears itself: with one neighbor u is less than 90 degrees off h, and the angle is
    less than arctan(k). With two neighbors every u is possible.
    """
    model: Any = FlockScenario()
    k = model.alignment_strength * model.time_step / model.mass
    return float(np.degrees(np.arctan(k) if neighbors == 1 else np.arcsin(k)))


def one_agent_figure(file: Path) -> Figure:
    """Draw the agent's heading, and below what it would hear under each range and the ranges that it sets."""
    kept = read_npz(file, "headings")
    figure, panels = subplots(4.2, 2, 2, sharex=True, sharey="row", height_ratios=(2, 3))
    for column, (name, title) in enumerate(_TITLES.items()):
        heading, choice = panels[:, column]
        times = kept[f"{name}_times"]
        heading.plot(times, kept[f"{name}_own"], "o-", color=LIGHT.learned, lw=2, ms=3)
        heading.axhline(0, color=LIGHT.muted, lw=0.8)
        heading.set(ylim=(-8, 188), yticks=(0, 90, 180), title=title)
        edges, rows = np.append(times, times[-1] + times[1]), np.arange(len(CANDIDATES) + 1) - 0.5
        heard = kept[f"{name}_heard"].swapaxes(0, 1)
        mesh = choice.pcolormesh(edges, rows, heard, cmap=RANGES.reversed(), vmin=0, vmax=180)
        places = np.interp(kept[f"{name}_chosen"], CANDIDATES, range(len(CANDIDATES)))
        choice.plot(times + times[1] / 2, places, "o", mfc=LIGHT.page, mec=LIGHT.ink, ms=4.5, mew=0.8)
        names = ["0: fly straight", *(f"{rho:g} m" for rho in CANDIDATES[1:])]
        choice.set_yticks(range(len(CANDIDATES)), names)
        choice.set(xlim=(0, _SHOWN), xlabel="time (s)")
    panels[0, 0].set_ylabel("own heading,\ndegrees off")
    panels[1, 0].set_ylabel("range")
    figure.colorbar(mesh, ax=panels[1], label="heading that it\nwould hear,\ndegrees off", ticks=(0, 90, 180))
    return figure
