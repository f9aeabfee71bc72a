"""95 % intervals: t of means, Wilson of shares, bootstrap of the best range; needs the extra ``analysis``."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common.checks import as_floats, as_vector
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require

require("analysis", ["scipy"])
from scipy.special import ndtri, stdtrit  # noqa: E402, after the check

FloatArray = NDArray[np.float64]

CONFIDENCE = 0.95
RESAMPLES = 999


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
    """Return the mean of the values, shape (flocks,), with its t interval; infinite for one flock."""
    values = as_vector(values, "values")
    if len(values) == 1:
        return Estimate(float(values[0]), -np.inf, np.inf)
    return Estimate(*map(float, mean_with_interval(values)))


def mean_with_interval(
    values: FloatArray, confidence: float = CONFIDENCE
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean over the last axis, the seeds, and the ends of its Student's t interval."""
    count = values.shape[-1]
    if count < 2:
        raise InputError("seeds", "at least 2 for an interval", count)
    center = values.mean(axis=-1)
    half = half_width((values - values[..., :1]).var(axis=-1, ddof=1) / count, count - 1, confidence)
    return center, center - half, center + half


def half_width(variance: ArrayLike, freedom: ArrayLike, confidence: float = CONFIDENCE) -> FloatArray:
    """Return half a t interval's width from the variance of the estimate and its degrees of freedom."""
    half: FloatArray = stdtrit(freedom, 0.5 + confidence / 2) * np.sqrt(variance)
    return half


def improvement(values: FloatArray, baseline: FloatArray) -> Estimate:
    """Return the probability of improvement: the share of flocks with ``values`` > ``baseline``.

    Ties count half. Both arguments have shape (flocks,).
    """
    values = as_vector(values, "values")
    baseline = as_floats(baseline, "baseline", values.shape)
    return share((values > baseline) + 0.5 * (values == baseline))


def share(values: NDArray[Any]) -> Estimate:
    """Return the mean of values from 0 to 1, or truth values, shape (flocks,), with its Wilson interval."""
    found, error = float(values.mean()), ndtri(0.5 + CONFIDENCE / 2) ** 2 / len(values)
    center = (found + error / 2) / (1 + error)
    half = np.sqrt(error * found * (1 - found) + error**2 / 4) / (1 + error)
    return Estimate(found, float(center - half), float(center + half))


def argmax(positions: FloatArray, values: FloatArray) -> Estimate:
    """Return the position of the largest mean over flocks, with its percentile bootstrap interval.

    Flocks are drawn again. Both ends are positions, which have shape (k,), for example interaction ranges;
    values have shape (k, flocks).
    """
    positions, values = as_vector(positions, "positions"), as_floats(values, "values")
    rng, flocks = np.random.default_rng(0), values.shape[1]
    samples = (values[:, rng.integers(flocks, size=flocks)] for _ in range(RESAMPLES))
    found = positions[[int(sample.mean(axis=1).argmax()) for sample in samples]]
    ends = np.quantile(found, [0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2], method="inverted_cdf")
    return Estimate(float(positions[values.mean(axis=1).argmax()]), *map(float, ends))
