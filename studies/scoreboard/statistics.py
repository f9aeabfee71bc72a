"""Figures per policy over training seeds and flocks, with 95 % t intervals that cover both.

All flocks of a run share the policy of its training seed, so episodes are not independent. ``means`` treats
training seeds and flocks as two crossed random factors. The mean squares of the two-way analysis of variance
give the variance of the mean. Its degrees of freedom are those of Satterthwaite, "An approximate distribution
of estimates of variance components" (1946). Where training seeds dominate, it is Student's interval over the
training seeds.
"""

import numpy as np

from flockesc_env.common.stats import Estimate, FloatArray, half_width


def means(scores: FloatArray, other: FloatArray | None = None) -> list[Estimate]:
    """Return the mean of every score, minus the other ones if given, with its interval over seeds and flocks.

    Scores have the shape (scores, training seeds, flocks). With one training seed, the interval covers the
    flocks alone.
    """
    by_flock, free = scores.mean(axis=1), scores.shape[2] - 1
    parts = _seed_parts(scores)
    if other is not None:
        by_flock = by_flock - other.mean(axis=1)
        parts += _seed_parts(other)
    flocks = by_flock.var(axis=1, ddof=1) / (free + 1)
    seeds = sum((part for part, _, _ in parts), np.zeros(len(scores)))
    total = seeds + flocks - sum((rest for _, rest, _ in parts), np.zeros(len(scores)))
    total = np.maximum(total, np.maximum(seeds, flocks))
    squares = flocks**2 / free
    for part, rest, others in parts:
        squares += (part**2 + rest**2 / free) / others
    freedom = np.divide(total**2, squares, out=np.full(len(scores), float(free)), where=squares > 0)
    half = half_width(total, freedom)
    mean = by_flock.mean(axis=1)
    return [Estimate(*map(float, row)) for row in zip(mean, mean - half, mean + half, strict=True)]


def difference(values: FloatArray, other: FloatArray) -> Estimate:
    """Return the mean paired difference of two policies, each of shape (its training seeds, flocks)."""
    (found,) = means(values[np.newaxis], other[np.newaxis])
    return found


def _seed_parts(scores: FloatArray) -> list[tuple[FloatArray, FloatArray, int]]:
    """Return the variances of the mean that training seeds, and what they and flocks leave, contribute.

    The degrees of freedom of the first one come with them. The list is empty for one training seed.
    """
    _, num_seeds, num_flocks = scores.shape
    if num_seeds == 1:
        return []
    by_seed, by_flock = scores.mean(axis=2, keepdims=True), scores.mean(axis=1, keepdims=True)
    rest = scores - by_seed - by_flock + by_flock.mean(axis=2, keepdims=True)
    free = num_seeds - 1
    error = (rest**2).sum(axis=(1, 2)) / (free * (num_flocks - 1)) / (num_seeds * num_flocks)
    return [(by_seed[:, :, 0].var(axis=1, ddof=1) / num_seeds, error, free)]
