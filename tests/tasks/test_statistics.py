"""Rows and intervals over training seeds and flocks, compared with NumPy and SciPy."""

from dataclasses import astuple
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from scipy import stats
from scipy.stats import t, ttest_1samp, ttest_ind

from flockesc_env import sweep
from flockesc_env.common.stats import Estimate
from flockesc_env.taskset.results import PolicyResult, Result, Training, read_result
from flockesc_env.taskset.task import FLOCKS, VERSION, tasks
from studies.scoreboard.board import BEST_FIXED, column_of, score_of, scores_of
from studies.scoreboard.statistics import difference, means

NUM_FLOCKS = 40
TASKS = ("held-out-predators", "line", "one-range")
"""They differ in the number of scenarios and in the objective."""


def made_up(task_name: str, learner: str, level: float, seeds: int, *, is_code: bool = False) -> Result:
    """Return a result whose scores are around a level."""
    task, rng = tasks[task_name], np.random.default_rng([*learner.encode(), *task_name.encode()])

    def objectives() -> dict[str, list[float]]:
        shift = rng.normal(level, 0.1)
        return {
            name: (scale.zero + (scale.one - scale.zero) * rng.normal(shift, 0.3, NUM_FLOCKS)).tolist()
            for name, scale in task.scales.items()
        }

    return Result(
        version=VERSION,
        task=task_name,
        task_sha256=task.sha256,
        flocks=(FLOCKS.start, NUM_FLOCKS),
        learner=learner,
        is_code=is_code,
        policies=[
            PolicyResult(policy=f"{at}.npz", sha256=f"{at}", objectives=objectives()) for at in range(seeds)
        ],
        training=Training(seeds=[*range(5, 5 + seeds)], samples=99, cpu_minutes=[1.0] * seeds, versions={}),
        versions={},
    )


def normalized(result: Result) -> np.ndarray:
    """Return the score of every policy on every flock, in plain words; the best fixed range has 0."""
    task, scores = tasks[result.task], []
    for name, scale in task.scales.items():
        fixed = sweep(task.scenarios[name], [scale.best_fixed_range], FLOCKS[:NUM_FLOCKS])
        gains = [np.array(p.objectives[name]) - fixed.values(task.spec.name)[0] for p in result.policies]
        scores.append(np.array(gains) / (scale.one - scale.zero))
    return np.array(scores).mean(axis=0)


def test_the_best_fixed_range_has_score_0_without_an_interval() -> None:
    constants = [read_result(path) for path in Path("scoreboard/fixed-range").glob("*.json")]
    assert constants
    for result in constants:
        assert astuple(score_of(result)) == pytest.approx((0, 0, 0), abs=1e-12), result.task
    stored = pl.read_parquet(BEST_FIXED)
    for task in tasks.values():
        means = {name: stored[column_of(task, name)].mean() for name in task.scales}
        assert means == {name: pytest.approx(scale.zero, rel=1e-12) for name, scale in task.scales.items()}


@pytest.mark.parametrize("task", TASKS)
def test_scores_are_those_of_numpy_and_scipy(task: str) -> None:
    results = [made_up(task, "rule", 0.3, 1), made_up(task, "ppo", 0.42, 5), made_up(task, "tqc", 0.4, 4)]
    for result in results:
        scores, score = normalized(result), score_of(result)
        own = scores.mean(axis=1)
        np.testing.assert_allclose(scores_of(result).mean(axis=1), own, rtol=1e-12)
        assert score.mean == pytest.approx(own.mean(), rel=1e-12)
        if result.learner == "rule":  # one policy: Student's interval over flocks
            (scale, *_) = tasks[task].scales.values()  # the reference plays 200 flocks of one-range
            error = own.mean() * scale.one_error / (scale.one - scale.zero)
            half = np.hypot(stats.t.interval(0.95, NUM_FLOCKS - 1, 0, stats.sem(scores[0]))[1], error)
            interval = (own.mean() - half, own.mean() + half)
            assert (score.low, score.high) == pytest.approx(interval, rel=1e-12)


def drawn(*shape: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape)


def test_intervals_are_students_where_only_flocks_or_only_training_seeds_vary() -> None:
    flocks, seeds = drawn(12), drawn(5, seed=1)
    (one,) = means(flocks[None, None])
    assert (one.low, one.high) == pytest.approx(tuple(ttest_1samp(flocks, 0).confidence_interval()))
    (many,) = means(np.repeat(seeds[:, None], 12, axis=1)[None])
    assert (many.low, many.high) == pytest.approx(tuple(ttest_1samp(seeds, 0).confidence_interval()))
    (same,) = means(np.full((1, 3, 4), 2.0))
    assert same == Estimate(2.0, 2.0, 2.0)


def test_intervals_follow_from_the_mean_squares_of_the_two_way_analysis_of_variance() -> None:
    # Rows 1 2 6, 3 4 8: seeds' mean square 6, flocks' 20.333.., no rest. Total 26.33..; see Satterthwaite.
    (found,) = means(np.array([[[1.0, 2.0, 6.0], [3.0, 4.0, 8.0]]]))
    seeds, flocks = 6.0, 2 * np.var([2, 3, 7], ddof=1)
    freedom = (seeds + flocks) ** 2 / (seeds**2 / 1 + flocks**2 / 2)
    half = t.ppf(0.975, freedom) * np.sqrt((seeds + flocks) / 6)
    assert (found.mean, found.low, found.high) == pytest.approx((4.0, 4.0 - half, 4.0 + half))


def test_differences_of_two_learners_cover_both_training_seeds() -> None:
    flocks, mine, other = drawn(12), drawn(4, 1, seed=1), drawn(3, 1, seed=2)
    found = difference(flocks + mine, flocks + other)
    # Flocks cancel. What remains is Welch's interval of two samples of training seeds.
    welch = ttest_ind(mine[:, 0], other[:, 0], equal_var=False).confidence_interval()
    assert (found.low, found.high) == pytest.approx(tuple(welch))
    (paired,) = means((flocks + mine - drawn(12, seed=3))[None])
    one = difference(flocks + mine, drawn(12, seed=3)[None])
    assert (one.mean, one.low, one.high) == pytest.approx((paired.mean, paired.low, paired.high))


@pytest.mark.parametrize("num_seeds", [3, 5, 10])
@pytest.mark.parametrize("scales", [(1.0, 0.1, 0.1), (1.0, 5.0, 5.0), (0.1, 5.0, 1.0)])
def test_intervals_cover_the_true_mean(scales: tuple[float, float, float], num_seeds: int) -> None:
    """Scales: of the effects of training seeds, of flocks, and of both together; the true mean is 0."""
    seeds, flocks, both = (
        scale * drawn(2_000, *shape, seed=at)
        for at, (scale, shape) in enumerate(
            zip(scales, [(num_seeds, 1), (1, 50), (num_seeds, 50)], strict=True)
        )
    )
    found = means(seeds + flocks + both)
    assert 0.93 <= np.mean([one.low < 0 < one.high for one in found]) <= 0.985
