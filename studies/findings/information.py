"""What candidate ranges are worth: the objective against their number, by the predator's sensing range."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import polars as pl
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from flockesc_env import rollout
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import mean
from flockesc_env.episodes.splits import HELD_OUT, first_seeds
from flockesc_env.jobs import Arrays, Job
from flockesc_env.policies import BestCandidate
from flockesc_env.render.palette import LIGHT
from studies.measurements import Runner
from studies.style import curve
from studies.tables import rows, values_by
from training.figure_style import WIDTH, label_ends

INFORMATION_FILE = "information.parquet"

CANDIDATES: Final[dict[int, tuple[float, ...]]] = {
    1: (20,),
    2: (10, 20),
    4: (5, 10, 20, 40),
    8: (5, 10, 15, 20, 30, 40, 60, 100),
    15: (3, 5, 7, 10, 13, 16, 20, 25, 30, 40, 50, 60, 70, 85, 100),
}
"""Candidate ranges in m besides 0, by their number."""

SENSING: Final[dict[str, float | None]] = {"30 m": 30.0, "60 m": 60.0, "100 m": 100.0, "any distance": None}
"""Distances at which agents see the predator."""

UNAWARE_RANGE = 12.0
"""Range in m of agents that see no predator: the best fixed range."""

STEPS_PER_ACTION = 4
_COUNTS = (0, *CANDIDATES)
_SECONDS = 0.1


def measure_information(results: Path, num_flocks: int, runner: Runner) -> Path:
    """Measure the rule ``turn-away`` on held-out flocks; return the file of the table."""
    flocks = first_seeds(HELD_OUT, num_flocks)
    jobs = {
        (name, count): Job(f"{__name__}:objective", (name, count, flocks), num_flocks * _SECONDS)
        for name in SENSING
        for count in _COUNTS
    }
    found = runner.each(jobs, "Numbers of candidate ranges")
    tables = [
        rows(flocks, result["objective"], sensing=name, candidates=count)
        for (name, count), result in found.items()
    ]
    write_table(pl.concat(tables), results / INFORMATION_FILE)
    return results / INFORMATION_FILE


def objective(sensing: str, count: int, flocks: range) -> Arrays:
    """Return J_mean in m of the rule with ``count`` candidates besides 0; without any, of the best range."""
    if not count:
        return {"objective": rollout(None, f"fixed:{UNAWARE_RANGE}", flocks).min_mean_distance}
    options: dict[str, Any] = {
        "profile_ranges": (0.0, *CANDIDATES[count]),
        "extra_entries": ("escape_direction",),
        "predator_sensing_range": SENSING[sensing],
        "steps_per_action": STEPS_PER_ACTION,
    }
    policy = BestCandidate("escape_cosine", unaware_range=UNAWARE_RANGE)
    return {"objective": rollout(None, policy, flocks, **options).min_mean_distance}


def draw_information(file: Path) -> Figure:
    """Draw the mean objective against the number of candidates, a line per sensing range."""
    values = values_by(pl.read_parquet(file), "sensing", "candidates")
    figure = Figure(figsize=(WIDTH / 2, 3.2), layout="constrained")
    axes = figure.subplots()
    ends = []
    for color, name in zip(LIGHT.others, SENSING, strict=False):
        found = [mean(values[name, count]) for count in _COUNTS]
        curve(axes, _COUNTS, found, color, "o-", band=0.15, lw=1.8, ms=4)
        ends.append((found[-1].mean, name, color))
    axes.set_xscale("symlog", linthresh=1)
    axes.set_xticks(_COUNTS, [str(count) for count in _COUNTS])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set(xlabel="candidate ranges besides 0", ylabel="J_mean (m)")
    axes.set_title("Rule turn-away, by sensing range")
    axes.grid(axis="y")
    label_ends(axes, ends)
    return figure
