"""One agent that waits: its heading, what it would hear under each range, and the range that it sets."""

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
from flockesc_env.render.palette import LIGHT
from studies.findings.controls import watch
from studies.findings.headlines import Headline
from studies.measurements import Runner, policy_of
from studies.style import subplots
from training.figure_style import RANGES

ONE_AGENT: Final = "one_agent.npz"
CANDIDATES: Final = (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0)
"""Ranges in m whose heard velocity the figure shows. They are also those of the rule."""

BLIND: Final = "per-agent-visible-derived"
_TITLES = {"blind": "Without a profile: the best policy", "informed": "With a profile: the rule turn-away"}
_AHEAD = 30.0  # degrees off its escape direction within which an agent counts as escaping
_SHOWN = 2.0  # seconds of the figure


def measure(headlines: Sequence[Headline], runner: Runner, output: Path) -> None:
    """Write the file of what ``follow`` returns for ``BLIND``."""
    content = next(one.content for one in headlines if one.task.name == BLIND)
    write_npz(output / ONE_AGENT, runner.join([Job(f"{__name__}:follow", (content,))], "Listening"))


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
    agent = _median_agent(runs["blind"]["own"])
    return {
        f"{name}_{part}": values if part == "times" else values[:, agent]
        for name, run in runs.items()
        for part, values in run.items()
    }


def _median_agent(own: FloatArray) -> int:
    """Return the agent of ``follow`` from all agents' angles in degrees, shape (actions, agents)."""
    escapes = own < _AHEAD
    arrival = np.where(escapes.any(axis=0), escapes.argmax(axis=0), len(own))
    agents = np.flatnonzero(own[0] > 120)
    by_arrival = agents[np.argsort(arrival[agents], kind="stable")]
    return int(by_arrival[len(agents) // 2])


def _run(policy: BasePolicy, max_range: float | None = None) -> dict[str, NDArray[Any]]:
    """Run a policy; its observation also has the profile, which the policy does not see if it is blind."""
    extra = ("escape_direction", "closest_approach")
    known = policy.policy_spec.options
    longest = max_range or known.max_range
    profile = [rho for rho in CANDIDATES if rho <= longest]
    seeing: dict[str, Any] = {"max_range": longest, "profile_ranges": profile, "extra_entries": extra}
    scenario = FlockScenario()
    watched = watch(policy.with_options(scenario=scenario, **seeing), first_seeds(HELD_OUT, 1))
    heard = np.full((*watched.ranges.shape, len(CANDIDATES)), np.nan)
    for k, rho in enumerate(profile):
        hears = (watched.entry(f"profile_{k}_neighbor_count") > 0) | (rho == 0)
        heard[..., k] = np.where(hears, _degrees(watched.entry(f"profile_{k}_escape_cosine")), np.nan)
    return {
        "times": np.arange(len(watched.ranges)) * (known.steps_per_action * scenario.time_step),
        "own": _degrees(watched.entry("escape_direction_ahead")),
        "heard": heard,
        "chosen": watched.ranges,
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
