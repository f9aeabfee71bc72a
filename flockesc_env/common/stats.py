"""Bootstrap and Wilson intervals (95 %) of means, shares and the best range; needs the ``analysis`` extra."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, bootstrap

from flockesc_env.common.checks import as_floats, as_vector
from flockesc_env.common.errors import InputError

FloatArray = NDArray[np.float64]

CONFIDENCE = 0.95
RESAMPLES = 9_999


@dataclass(frozen=True)
class Estimate:
    """An estimate, ``mean``, with the ends of its 95 % interval."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self:.2f}"

    def __format__(self, form: str) -> str:
        form = form or ".2f"
        return f"{self.mean:{form}} [{self.low:{form}}, {self.high:{form}}]"


def mean(values: FloatArray) -> Estimate:
    """Return the mean of the values, shape (flocks,), with its percentile bootstrap interval."""
    values = as_vector(values, "values")
    if np.ptp(values) == 0:  # all resamples are equal
        return Estimate(float(values[0]), float(values[0]), float(values[0]))
    low, high = _interval(values, np.mean)
    return Estimate(float(values.mean()), float(low), float(high))


def mean_with_interval(values: FloatArray, confidence: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean over the last axis, the seeds, and the ends of its percentile bootstrap interval."""
    if values.shape[-1] < 2:
        raise InputError("seeds", "at least 2 for an interval", values.shape[-1])
    level = float(as_floats(confidence, "confidence", ()))
    if not 0 < level < 1:
        raise InputError("confidence", "a number between 0 and 1", level)
    return values.mean(axis=-1), *_interval(values, np.mean, 2000, level)


def improvement(values: FloatArray, baseline: FloatArray) -> Estimate:
    """Return the probability of improvement: the share of flocks with ``values`` > ``baseline``.

    Ties count half. Both arguments have shape (flocks,).
    """
    values = as_vector(values, "values")
    baseline = as_floats(baseline, "baseline", values.shape)
    return mean((values > baseline) + 0.5 * (values == baseline))


def share(is_so: NDArray[np.bool]) -> Estimate:
    """Return the share of true values, shape (flocks,), with its Wilson interval."""
    test = binomtest(int(is_so.sum()), len(is_so))
    interval = test.proportion_ci(CONFIDENCE, method="wilson")
    return Estimate(float(test.statistic), float(interval.low), float(interval.high))


def argmax(positions: FloatArray, values: FloatArray) -> Estimate:
    """Return the position of the largest mean over flocks, with its bootstrap interval.

    Positions have shape (k,), for example interaction ranges; values have shape (k, flocks).
    """
    positions, values = as_vector(positions, "positions"), as_floats(values, "values")

    def place(flocks: NDArray[np.int64], axis: int) -> Any:
        return positions[np.argmax(values[:, flocks].mean(axis=axis), axis=0)]

    low, high = _interval(np.arange(values.shape[1]), place, resamples=999)
    return Estimate(float(positions[np.argmax(values.mean(axis=1))]), float(low), float(high))


def _interval(
    sample: NDArray[Any],
    statistic: Callable[..., Any],
    resamples: int = RESAMPLES,
    confidence: float = CONFIDENCE,
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the interval of a statistic of the last axis."""
    interval = bootstrap(
        (sample,),
        statistic,
        axis=-1,
        confidence_level=confidence,
        n_resamples=resamples,
        method="percentile",
        batch=50,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return interval.low, interval.high
