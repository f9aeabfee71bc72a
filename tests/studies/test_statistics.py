"""Statistics of policies over training seeds and flocks: intervals that cover."""

import numpy as np
import pytest
from scipy.stats import t, ttest_1samp, ttest_ind

from flockesc_env.common.stats import Estimate
from flockesc_env.tasks.statistics import difference, intervals, means, profile


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


def test_shares_stay_within_0_and_1() -> None:
    # Imported here, because it takes seconds in every worker that collects this file.
    from rliable.library import score_distributions

    values = drawn(3, 12)
    share, low, high = profile(values, np.array([-3.0, 0.3, 2.0]))
    assert share == pytest.approx(score_distributions(values, [-3.0, 0.3, 2.0]))
    assert (low >= 0).all()
    assert (high <= 1).all()
    assert low[1] < share[1] < high[1]


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
    _, low, high = intervals(seeds + flocks + both)
    assert 0.93 <= ((low < 0) & (high > 0)).mean() <= 0.985


@pytest.mark.parametrize("strength", [0.0, 0.1, 1.0])
def test_intervals_of_differences_cover_the_true_difference(strength: float) -> None:
    rng = np.random.default_rng(0)
    flocks = rng.normal(size=(2_000, 1, 50))

    def runs(num_seeds: int, response: float) -> np.ndarray:
        seeds = strength * rng.normal(size=(2_000, num_seeds, 1))
        return seeds + response * flocks + rng.normal(size=(2_000, num_seeds, 50))

    _, low, high = intervals(runs(5, 1.0), runs(3, 0.5))
    assert 0.93 <= ((low < 0) & (high > 0)).mean() <= 0.985
