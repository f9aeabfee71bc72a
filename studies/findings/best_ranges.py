"""The best fixed range that each study chooses, and how little the choice matters."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from flockesc_env.common.stats import Estimate, mean
from studies.findings.results import Study
from studies.tables import values_by

COMPARED = (10.0, 12.0, 14.0)
"""Ranges in m that are compared: the paper's best one, the studies', and the largest of their intervals."""


@dataclass(frozen=True)
class Choice:
    """A best fixed range for J_mean in the paper's flock, and the ends of its 95 % interval, all in m.

    ``step`` lies between two ranges of its grid near the best one.
    """

    command: str
    step: float
    num_flocks: int
    best: float
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class BestRanges:
    """The choices of the studies, and paired differences in J_mean in m between two ranges in m."""

    choices: tuple[Choice, ...]
    differences: dict[tuple[float, float], Estimate]
    num_flocks: int


def best_ranges(results: Path, study: Study) -> BestRanges | None:
    """Read the choices from the results of all studies; ``None`` if files are missing.

    The given study is of a setting in the paper's flock.
    """
    demo = results / "demo"
    files = [results / "paper/results.json", results / "robustness/results.json", demo / "comparison.json"]
    table = demo / "grid_search.parquet"
    if not all(file.is_file() for file in (*files, table)):
        return None
    paper, robustness, comparison = (json.loads(file.read_text("utf-8")) for file in files)
    arguments = comparison["args"]
    (claim,) = (claim for claim in paper["claims"] if claim["where"] == "V, Fig. 9b")
    (preset,) = (preset for preset in robustness["presets"] if preset["name"] == "paper-flock")
    first, second = preset["grid"]["actions"][:2]
    values = values_by(pl.read_parquet(table), "interaction_range", column="min_mean_distance")
    best = _demo_range(demo / "table.parquet")
    below = max(value for value in values if value < best)
    choices = (
        _estimated("studies paper", 1.0, paper["trials"]["flocks"], claim["measured"][0]["value"]),
        _estimated(
            "studies robustness",
            second - first,
            robustness["num_flocks"],
            preset["outcomes"]["J_mean"]["best"],
        ),
        Choice(
            "studies learned", study.grid["interaction_range"][1], study.tuning_flocks, study.best_fixed_range
        ),
        Choice("training compare", best - below, arguments["tuning_flocks"], best),
    )
    pairs = [(COMPARED[0], COMPARED[1]), (COMPARED[2], COMPARED[1]), (COMPARED[0], COMPARED[2])]
    differences = {(one, other): mean(values[one] - values[other]) for one, other in pairs}
    return BestRanges(choices, differences, len(values[COMPARED[0]]))


def _estimated(command: str, step: float, num_flocks: int, best: dict[str, float]) -> Choice:
    return Choice(command, step, num_flocks, best["mean"], (best["low"], best["high"]))


def _demo_range(table: Path) -> float:
    """Return the range in the name of the baseline."""
    names = "\n".join(pl.read_parquet(table)["policy"].to_list())
    (best,) = re.findall(r"^best fixed range \(([\d.]+) m\)$", names, re.MULTILINE)
    return float(best)
