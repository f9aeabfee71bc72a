"""Scores of results with their intervals."""

from __future__ import annotations

import math
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


def scores_of(result: Result) -> FloatArray:
    """Return the score of every policy on every flock, shape (policies, flocks); the mean over scenarios.

    The best fixed range has score 0 on each flock, so intervals are those of paired differences.
    """
    task = tasks[result.task]
    best_fixed = _best_fixed()[: result.flocks[1]]
    paired = {
        name: scale.zero + (result.values(name) - best_fixed[column_of(task, name)].to_numpy())
        for name, scale in task.scales.items()
    }
    scores: FloatArray = task.normalize(paired)
    return scores


def score_of(result: Result) -> Estimate:
    """Return the mean score; its interval covers training seeds, flocks and the error of score 1."""
    (score,) = means(scores_of(result)[np.newaxis])
    return with_reference_error(score, tasks[result.task])


def best_fixed_range(task: Task) -> float:
    """Return the best fixed range in the first scenario of a task."""
    return next(iter(task.scales.values())).best_fixed_range


def column_of(task: Task, scenario: str) -> str:
    """Return the column of ``BEST_FIXED`` for the objective of a task in a scenario."""
    return f"{scenario} {task.spec.name}"


@cache
def _best_fixed() -> pl.DataFrame:
    return pl.read_parquet(BEST_FIXED)


def with_reference_error(estimate: Estimate, task: Task) -> Estimate:
    """Return a score, or a difference of scores, with the error of score 1 in its interval.

    An error of ``one`` changes every score by the same factor. Half widths of independent errors add in
    quadrature.
    """
    error = estimate.mean * max(scale.one_error / (scale.one - scale.zero) for scale in task.scales.values())
    low, high = (math.hypot(end - estimate.mean, error) for end in (estimate.low, estimate.high))
    return Estimate(estimate.mean, estimate.mean - low, estimate.mean + high)
