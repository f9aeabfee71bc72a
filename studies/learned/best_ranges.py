"""The best fixed range that each study chooses, and how little the choice matters."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from flockesc_env.common.stats import Estimate, FloatArray, mean
from studies.learned.results import Study

COMPARED = (9.0, 12.0, 13.5)
"""Ranges in m of the demo's grid that are compared: each is the best one for some grid and some flocks."""


@dataclass(frozen=True)
class Choice:
    """A best fixed range for J_mean in the paper's flock.

    Attributes:
        command: that finds it.
        step: between two ranges of its grid near the best one, in m.
        num_flocks: number of flocks on which it is chosen.
        best: the range, in m.
        interval: ends of its 95 % interval in m, or ``None``.
    """

    command: str
    step: float
    num_flocks: int
    best: float
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class BestRanges:
    """The best fixed range of each study.

    Attributes:
        choices: a row per study.
        differences: paired differences in J_mean in m between two ranges in m, on the demo's flocks.
        num_flocks: number of these held-out flocks.
    """

    choices: tuple[Choice, ...]
    differences: dict[tuple[float, float], Estimate]
    num_flocks: int


def best_ranges(results: Path, study: Study) -> BestRanges | None:
    """Read the choices from the results of the studies; ``None`` if files are missing.

    Args:
        results: folder of the results of all studies.
        study: of a setting in the paper's flock.
    """
    files = [results / name for name in ("paper/results.json", "robustness/results.json")]
    demo, table = results / "demo" / "comparison.json", results / "demo" / "grid_search.parquet"
    if not all(file.is_file() for file in (*files, demo, table)):
        return None
    paper, robustness = (json.loads(file.read_text()) for file in files)
    arguments = json.loads(demo.read_text())["args"]
    (claim,) = (claim for claim in paper["claims"] if claim["where"] == "V, Fig. 9b")
    (preset,) = (preset for preset in robustness["presets"] if preset["name"] == "paper-flock")
    grid = preset["grid"]["actions"]
    choices = (
        _estimated("studies paper", 1.0, paper["trials"]["flocks"], claim["measured"][0]["value"]),
        _estimated(
            "studies robustness",
            grid[1] - grid[0],
            robustness["num_flocks"],
            preset["outcomes"]["J_mean"]["best"],
        ),
        Choice(
            "studies learned",
            study.grid["interaction_range"][1],
            study.tuning_flocks,
            study.best_fixed_range,
        ),
        Choice(
            "training compare",
            arguments["max_range"] / (arguments["grid_size"] - 1),
            arguments["tuning_flocks"],
            _demo_range(demo.with_name("table.parquet")),
        ),
    )
    values = _values(table)
    pairs = [(COMPARED[0], COMPARED[1]), (COMPARED[2], COMPARED[1]), (COMPARED[0], COMPARED[2])]
    differences = {(one, other): mean(values[one] - values[other]) for one, other in pairs}
    return BestRanges(choices, differences, len(values[COMPARED[0]]))


def _estimated(command: str, step: float, num_flocks: int, best: dict[str, Any]) -> Choice:
    return Choice(command, step, num_flocks, best["mean"], (best["low"], best["high"]))


def _demo_range(table: Path) -> float:
    """Return the range in the name of the baseline."""
    names = pl.read_parquet(table)["policy"].to_list()
    (best,) = (
        found[1] for name in names if (found := re.fullmatch(r"best fixed range \(([\d.]+) m\)", name))
    )
    return float(best)


def _values(grid: Path) -> dict[float, FloatArray]:
    table = pl.read_parquet(grid).sort("seed")
    column = "min_mean_distance"
    return {rho: table.filter(interaction_range=rho)[column].to_numpy() for rho in COMPARED}
