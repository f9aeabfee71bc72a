"""Results of learners as rows of the table of a task, with intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.taskset.results import Result
from flockesc_env.taskset.statistics import means
from flockesc_env.taskset.task import Task, tasks


@dataclass(frozen=True)
class Row:
    """The score of a learner on a task.

    Attributes:
        result: the result.
        score: mean score with its 95 % t interval over training seeds and flocks, and the error of score 1.
        low: score of the worst training seed.
        high: score of the best training seed.
    """

    result: Result
    score: Estimate
    low: float
    high: float


def scores_of(result: Result) -> FloatArray:
    """Return the score of every policy on every flock, shape (policies, flocks); the mean over scenarios."""
    task = tasks[result.task]
    scores: FloatArray = task.normalize({name: result.values(name) for name in task.scales})
    return scores


def rows(results: Sequence[Result]) -> dict[str, list[Row]]:
    """Return the rows of every task, the highest score first."""
    found: dict[str, list[Row]] = {}
    for task in dict.fromkeys(result.task for result in results):
        for result in (one for one in results if one.task == task):
            own = result.scores()
            (score,) = means(scores_of(result)[np.newaxis])
            score = with_reference_error(score, tasks[task])
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
