"""How often 95 % intervals contain the true mean: simulated training seeds and flocks.

The intervals of ``flockesc_env.tasks.statistics`` against those of a percentile bootstrap that draws
whole seeds and whole flocks (Owen, "The pigeonhole bootstrap", 2007). Those are too narrow for few seeds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import CONFIDENCE, FloatArray
from flockesc_env.tasks.statistics import intervals

COVERAGE_FILE = "coverage.parquet"
NUM_FLOCKS = 200
NUM_TRIALS = 4_000
SEEDS = (3, 5, 10)
"""Numbers of training seeds."""

RESAMPLES = 1_000
"""Of the bootstrap."""

Interval = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class Variation:
    """How simulated objectives vary; the effects of flocks have the standard deviation 1.

    ``seeds`` is the standard deviation between training seeds times the square root of flocks per training
    seed: with 1, both contribute equally to the variance of the mean. Skewed effects are exponential.
    """

    seeds: float
    skewed: bool = False


VARIATIONS = {
    "training seeds dominate": Variation(10),
    "both vary": Variation(1),
    "flocks dominate": Variation(0),
    "training seeds dominate, skewed": Variation(10, skewed=True),
}
_NOISE = 0.5
"""Standard deviation of what neither the training seed nor the flock explains."""


def episodes(variation: Variation, num_seeds: int, num_trials: int, rng: np.random.Generator) -> FloatArray:
    """Return simulated objectives with the true mean 0, shape (trials, training seeds, flocks)."""
    draws = (num_trials, num_seeds, 1)
    effects = rng.exponential(size=draws) - 1 if variation.skewed else rng.normal(size=draws)
    seeds = variation.seeds * np.sqrt(num_seeds / NUM_FLOCKS) * effects
    flocks = rng.normal(size=(num_trials, 1, NUM_FLOCKS))
    values: FloatArray = seeds + flocks + _NOISE * rng.normal(size=(num_trials, num_seeds, NUM_FLOCKS))
    return values


def pigeonhole(scores: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return both ends of the percentile bootstrap interval of every score.

    All scores share the resamples, which keeps simulations short.
    """
    rng = np.random.default_rng(0)
    seeds, flocks = (rng.multinomial(n, np.full(n, 1 / n), size=RESAMPLES) / n for n in scores.shape[1:])
    resampled = np.einsum("tsb,bs->tb", scores @ flocks.T, seeds)
    low, high = np.quantile(resampled, [0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2], axis=1)
    return low, high


def two_way(scores: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return both ends of the t interval of every score."""
    _, low, high = intervals(scores)
    return low, high


def coverage(interval: Interval, variation: Variation, num_seeds: int, num_trials: int = NUM_TRIALS) -> float:
    """Return the share of simulated comparisons whose interval contains the true mean."""
    rng = np.random.default_rng(num_seeds)
    inside = 0
    for _ in range(0, num_trials, 100):
        low, high = interval(episodes(variation, num_seeds, 100, rng))
        inside += int(((low < 0) & (high > 0)).sum())
    return inside / num_trials


def measure_coverage(results: Path) -> Path:
    """Simulate all cases and write the table: ``variation``, ``training_seeds``, ``bootstrap``, ``t``."""
    table = pl.DataFrame(
        {
            "variation": name,
            "training_seeds": num_seeds,
            "bootstrap": coverage(pigeonhole, variation, num_seeds),
            "t": coverage(two_way, variation, num_seeds),
        }
        for name, variation in VARIATIONS.items()
        for num_seeds in SEEDS
    )
    write_table(table, results / COVERAGE_FILE)
    return results / COVERAGE_FILE


def read_coverage(path: Path) -> dict[str, list[dict[str, float]]]:
    """Return the coverages ``bootstrap`` and ``t`` by what varies, in the order of ``SEEDS``."""
    parts = pl.read_parquet(path).partition_by("variation", as_dict=True, maintain_order=True)
    return {str(name): rows.select("bootstrap", "t").to_dicts() for (name,), rows in parts.items()}
