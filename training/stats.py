"""Means, paired differences and probabilities of improvement with bootstrap intervals (scipy)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap

FloatArray = NDArray[np.float64]

CONFIDENCE = 0.95
RESAMPLES = 9_999


@dataclass(frozen=True)
class Estimate:
    """A mean with its bootstrap interval."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.mean:.2f} [{self.low:.2f}, {self.high:.2f}]"


def mean(values: FloatArray) -> Estimate:
    """Return the mean of one value per flock, shape (flocks,), with its percentile bootstrap interval."""
    if np.ptp(values) == 0:  # nothing to resample
        return Estimate(values[0], values[0], values[0])
    interval = bootstrap(
        (values,),
        np.mean,
        confidence_level=CONFIDENCE,
        n_resamples=RESAMPLES,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Estimate(float(values.mean()), float(interval.low), float(interval.high))


def improvement(values: FloatArray, baseline: FloatArray) -> Estimate:
    """Return the probability that a flock fares better than under the baseline, paired; ties count half."""
    return mean((values > baseline) + 0.5 * (values == baseline))
