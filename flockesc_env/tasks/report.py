"""Comparison of results: scores, aggregates over tasks and profiles; needs the extra ``analysis``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from typing import Any, Final
from warnings import catch_warnings, filterwarnings

import numpy as np
from matplotlib.figure import Figure
from rliable import metrics
from rliable.library import get_interval_estimates

from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import figure_style
from flockesc_env.common.files import atomic_write
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.tasks.results import Result
from flockesc_env.tasks.statistics import estimates, intervals, profile
from flockesc_env.tasks.task import Task, tasks

RESAMPLES: Final = 2000
_THRESHOLDS: Final = np.linspace(-0.5, 1.2, 171)

_LEGEND: Final = """
Scores have 95 % t intervals over training seeds and flocks. With one seed they cover the flocks.
They include the error of score 1, where the reference does not play all flocks.
*Better than the next* is the probability of improvement. It and the figures over all tasks have
stratified bootstrap intervals over training seeds (rliable).
"""


@dataclass(frozen=True)
class Row:
    """The score of a learner on a task.

    Attributes:
        result: the result.
        score: mean score with its 95 % t interval over training seeds and flocks, and the error of score 1.
        iqm: interquartile mean over training seeds.
        low: score of the worst training seed.
        high: score of the best training seed.
    """

    result: Result
    score: Estimate
    iqm: float
    low: float
    high: float


@dataclass(frozen=True)
class Aggregate:
    """Interquartile mean and mean of a learner over tasks, with stratified bootstrap intervals."""

    learner: str
    seeds: int
    iqm: Estimate
    mean: Estimate


def scores_of(result: Result) -> FloatArray:
    """Return the score of every policy on every flock, shape (policies, flocks); the mean over scenarios."""
    task = tasks[result.task]
    scores: FloatArray = task.normalize({name: result.values(name) for name in task.scales})
    return scores


def rows(results: Sequence[Result]) -> dict[str, list[Row]]:
    """Return the rows of every task, the highest score first; each learner may have one result on a task."""
    found: dict[str, list[Row]] = {}
    for task in dict.fromkeys(result.task for result in results):
        for result in (one for one in results if one.task == task):
            own = result.scores()
            mean, low, high = (float(end[0]) for end in intervals(scores_of(result)[np.newaxis]))
            score = with_reference_error(Estimate(mean, low, high), tasks[task])
            iqm, worst, best = float(metrics.aggregate_iqm(own)), float(own.min()), float(own.max())
            found.setdefault(task, []).append(Row(result, score, iqm, worst, best))
        found[task].sort(key=lambda row: -row.score.mean)
        names = [row.result.learner for row in found[task]]
        if len(set(names)) < len(names):
            raise InputError("results", f"one result per learner on {task}", ", ".join(names))
    return found


def aggregates(results: Sequence[Result]) -> list[Aggregate]:
    """Return the aggregates of learners with two or more training seeds on every task, the highest first.

    A learner counts with as many training seeds as it has on every task.
    """
    names = sorted({result.task for result in results})
    found: dict[str, FloatArray] = {}
    for learner in dict.fromkeys(result.learner for result in results):
        own = {result.task: result.scores() for result in results if result.learner == learner}
        seeds = min(map(len, own.values()))
        if set(own) == set(names) and seeds > 1:  # a bootstrap of one seed has no width
            found[learner] = np.stack([own[name][:seeds] for name in names], axis=1)
    if not found:
        return []
    points, ends = _bootstrap(
        found, lambda scores: np.array([metrics.aggregate_iqm(scores), metrics.aggregate_mean(scores)])
    )
    entries = [Aggregate(name, len(found[name]), *estimates(points[name], *ends[name])) for name in found]
    return sorted(entries, key=lambda entry: -entry.iqm.mean)


@figure_style()
def write_figure(results: Sequence[Result], path: Path) -> None:
    """Write a figure (png) with a panel per task: the share of episodes whose score is above each threshold.

    An existing file is replaced atomically.
    """
    names, learners = (list(dict.fromkeys(map(attrgetter(name), results))) for name in ("task", "learner"))
    columns = min(3, len(names))
    figure = Figure(figsize=(4 * columns + 2, 3 * -(-len(names) // columns)), layout="constrained")
    lines = {}
    for index, name in enumerate(names):
        axes = figure.add_subplot(-(-len(names) // columns), columns, index + 1)
        for result in (one for one in results if one.task == name):
            share, low, high = profile(scores_of(result), _THRESHOLDS)
            at = learners.index(result.learner)
            style: Any = {"color": f"C{at}", "linestyle": ("-", "--", ":", "-.")[at // 10 % 4]}
            (lines[result.learner],) = axes.plot(_THRESHOLDS, share, **style)
            axes.fill_between(_THRESHOLDS, low, high, color=f"C{at}", alpha=0.2)
        axes.set(title=name, xlabel="score", ylabel="share of episodes above", ylim=(0, 1))
    figure.legend([lines[name] for name in learners], learners, loc="outside right upper", fontsize="small")
    with atomic_write(path) as file:
        figure.savefig(file, format="png", dpi=150)


def page(results: Sequence[Result]) -> str:
    """Return the comparison as Markdown."""
    lines = ["# Report", ""]
    for task, entries in rows(results).items():
        lines += [f"## {task}", ""]
        lines += ["| learner | seeds | score | IQM | worst to best seed | better than the next |"]
        lines += ["|---|---|---|---|---|---|"]
        better = [improvement(one.result, other.result) for one, other in pairwise(entries)]
        for row, chance in zip(entries, [*better, None], strict=True):
            mark = " (played by its author's code)" if row.result.is_code else ""
            lines.append(
                f"| {row.result.learner}{mark} | {len(row.result.policies)} | {row.score:.3f} | {row.iqm:.3f}"
                f" | {row.low:.3f} to {row.high:.3f} | {chance or '-'} |"
            )
        lines.append("")
    if totals := aggregates(results):
        lines += [f"## All {len({result.task for result in results})} tasks", ""]
        lines += ["| learner | seeds | IQM | mean |", "|---|---|---|---|"]
        lines += [f"| {entry.learner} | {entry.seeds} | {entry.iqm} | {entry.mean} |" for entry in totals]
        lines.append("")
    return "\n".join(lines) + _LEGEND


def with_reference_error(estimate: Estimate, task: Task) -> Estimate:
    """Return a score, or a difference of scores, with the error of score 1 in its interval.

    An error of ``one`` changes every score by the same factor. Half widths of independent errors add in
    quadrature.
    """
    error = estimate.mean * max(scale.one_error / (scale.one - scale.zero) for scale in task.scales.values())
    low, high = (math.hypot(end - estimate.mean, error) for end in (estimate.low, estimate.high))
    return Estimate(estimate.mean, estimate.mean - low, estimate.mean + high)


def improvement(one: Result, other: Result) -> Estimate | None:
    """Return the probability that a run of a learner has a higher score than a run of another one.

    The stratified bootstrap interval needs two runs of both; None without them.
    """
    if min(len(one.policies), len(other.policies)) < 2:  # a bootstrap of one seed has no width
        return None
    pair = {"": (one.scores()[:, np.newaxis], other.scores()[:, np.newaxis])}
    points, ends = _bootstrap(pair, metrics.probability_of_improvement)
    return Estimate(float(points[""]), *map(float, ends[""][:, 0]))


def _bootstrap(scores: Mapping[str, Any], statistic: Callable[..., Any]) -> tuple[Any, Any]:
    """Return the statistic of every learner, and the ends of its stratified bootstrap interval."""
    rng = np.random.RandomState(0)
    with catch_warnings():
        filterwarnings("ignore", "random_state is deprecated", FutureWarning)  # from a library of rliable
        found: tuple[Any, Any] = get_interval_estimates(scores, statistic, reps=RESAMPLES, random_state=rng)
    return found
