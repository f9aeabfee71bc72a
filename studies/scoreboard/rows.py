"""Results of learners as rows of the table of a task, with intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np
import polars as pl

from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.taskset.results import Result
from flockesc_env.taskset.statistics import means
from flockesc_env.taskset.task import Task, tasks

BEST_FIXED: Final = Path("results/scoreboard/best_fixed.parquet")
"""The objective of the best fixed range on every held-out flock, a column per ``column_of``."""


@dataclass(frozen=True)
class Row:
    """The score of a learner on a task.

    Attributes:
        result: the result.
        score: mean score with its 95 % t interval over training seeds and flocks, and the error of score 1;
            paired with score 0.
        low: score of the worst training seed.
        high: score of the best training seed.
    """

    result: Result
    score: Estimate
    low: float
    high: float


def scores_of(result: Result) -> FloatArray:
    """Return the score of every policy on every flock, shape (policies, flocks); the mean over scenarios.

    The best fixed range has score 0 on each flock, so intervals are those of paired differences.
    """
    task, fixed = tasks[result.task], _best_fixed()[: result.flocks[1]]
    scores: FloatArray = task.normalize(
        {
            name: scale.zero + (result.values(name) - fixed[column_of(task, name)].to_numpy())
            for name, scale in task.scales.items()
        }
    )
    return scores


def column_of(task: Task, scenario: str) -> str:
    """Return the column of ``BEST_FIXED`` for the objective of a task in a scenario."""
    return f"{scenario} {task.spec.name}"


@cache
def _best_fixed() -> pl.DataFrame:
    return pl.read_parquet(BEST_FIXED)


def rows(results: Sequence[Result]) -> dict[str, list[Row]]:
    """Return the rows of every task, the highest score first."""
    found: dict[str, list[Row]] = {}
    for task in dict.fromkeys(result.task for result in results):
        for result in (one for one in results if one.task == task):
            scores = scores_of(result)
            own = scores.mean(axis=1)
            score = with_reference_error(means(scores[np.newaxis])[0], tasks[task])
            found.setdefault(task, []).append(Row(result, score, float(own.min()), float(own.max())))
        found[task].sort(key=lambda row: -row.score.mean)
    return found


def with_reference_error(estimate: Estimate, task: Task) -> Estimate:
    """Return a score, or a difference of scores, with the error of score 1 in its interval.

    An error of ``one`` changes every score by the same factor. Half widths of independent errors add in
    quadrature.
    """
    error = estimate.mean * max(scale.one_error / (scale.one - scale.zero) for scale in task.scales.values())
    low, high = (math.hypot(end - estimate.mean, error) for end in (estimate.low, estimate.high))
    return Estimate(estimate.mean, estimate.mean - low, estimate.mean + high)
