"""Figures per policy over training seeds and flocks, with 95 % intervals.

Agarwal et al., "Deep Reinforcement Learning at the Edge of the Statistical Precipice" (2021), with rliable.
Its stratified bootstrap resamples the training seeds of each task, which fits tasks with their own training.
Here all flocks share the policy of a training seed. This bootstrap draws whole seeds and whole flocks,
independently of each other (Owen, "The pigeonhole bootstrap", 2007). Otherwise the intervals are too narrow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rliable.metrics import aggregate_iqm
from scipy.stats import bootstrap, trim_mean

from flockesc_env.common.stats import CONFIDENCE, Estimate, FloatArray

RESAMPLES = 2_000

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Aggregate:
    """Figures of one policy.

    Attributes:
        objective: mean over training seeds and flocks.
        iqm: mean of the middle half of all episodes.
        difference: mean paired difference to the baseline, flock by flock.
        lowest: smallest mean difference of a training seed.
        highest: largest mean difference of a training seed.
        improvement: share of flocks with a larger objective than under the baseline; ties count half.
    """

    objective: Estimate
    iqm: Estimate
    difference: Estimate
    lowest: float
    highest: float
    improvement: Estimate


@dataclass(frozen=True)
class Profile:
    """Share of episodes above every threshold, each of shape (thresholds,)."""

    share: FloatArray
    low: FloatArray
    high: FloatArray


def aggregate(values: FloatArray, baseline: FloatArray) -> Aggregate:
    """Compute the figures of a policy.

    Args:
        values: objective, shape (training seeds, flocks); one row where nothing was trained.
        baseline: objective of the baseline on the same flocks, shape (flocks,).
    """
    difference = values - baseline
    better = (difference > 0) + 0.5 * (difference == 0)
    objective, gain, improvement = means(np.stack([values, difference, better]))
    per_seed = difference.mean(axis=1)
    return Aggregate(objective, iqm(values), gain, float(per_seed.min()), float(per_seed.max()), improvement)


def means(scores: FloatArray) -> list[Estimate]:
    """Return the mean of every score, shape (scores, training seeds, flocks)."""
    low, high = _mean_intervals(scores)
    points = scores.mean(axis=(1, 2))
    return [Estimate(*map(float, row)) for row in zip(points, low, high, strict=True)]


def iqm(values: FloatArray) -> Estimate:
    """Return the interquartile mean of all episodes, shape (training seeds, flocks)."""

    def resampled(seeds: Indices, flocks: Indices) -> FloatArray:
        drawn = values[seeds[:, :, None], flocks[:, None, :]].reshape(len(flocks), -1)
        middle: FloatArray = trim_mean(drawn, 0.25, axis=1)  # aggregate_iqm of all resamples at once
        return middle

    low, high = _interval(resampled, values.shape)
    return Estimate(float(aggregate_iqm(values)), float(low), float(high))


def profile(values: FloatArray, thresholds: FloatArray) -> Profile:
    """Return the performance profile of a policy.

    Args:
        values: objective, shape (training seeds, flocks).
        thresholds: shape (thresholds,).
    """
    above = (values > thresholds[:, None, None]).astype(np.float64)
    low, high = _mean_intervals(above)
    return Profile(above.mean(axis=(1, 2)), low, high)


def _mean_intervals(scores: FloatArray) -> tuple[FloatArray, FloatArray]:
    _, num_seeds, num_flocks = scores.shape

    def resampled(seeds: Indices, flocks: Indices) -> FloatArray:
        # A mean over drawn rows and columns is a weighted mean over all: two matrix products.
        per_seed = scores @ _weights(flocks, num_flocks).T
        mean: FloatArray = np.einsum("ksb,bs->kb", per_seed, _weights(seeds, num_seeds))
        return mean

    return _interval(resampled, (num_seeds, num_flocks))


def _weights(drawn: Indices, size: int) -> FloatArray:
    """Return the share of draws that each index has: (resamples, draws) to (resamples, size)."""
    places = drawn + size * np.arange(len(drawn))[:, None]
    counts = np.bincount(places.ravel(), minlength=len(drawn) * size)
    shares: FloatArray = counts.reshape(len(drawn), size) / drawn.shape[1]
    return shares


def _interval(
    statistic: Callable[[Indices, Indices], FloatArray], shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """Bootstrap a statistic of drawn training seeds and flocks, both of shape (resamples, draws)."""

    def resampled(*drawn: Any, axis: int) -> FloatArray:  # noqa: ARG001, always the last
        flocks = drawn[-1]
        seeds = drawn[0] if len(drawn) == 2 else np.zeros((len(flocks), 1), np.int64)
        return statistic(seeds, flocks)

    interval = bootstrap(
        # With one training seed, the interval covers the flocks alone.
        [np.arange(size) for size in shape if size > 1],
        resampled,
        confidence_level=CONFIDENCE,
        n_resamples=RESAMPLES,
        method="percentile",
        batch=100,
        vectorized=True,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return interval.low, interval.high
