"""CMA-ES, the evolution strategy that all searches share.

Hansen, "The CMA Evolution Strategy: A Tutorial" (2016), in the implementation of the library cmaes.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from cmaes import CMA

from flockesc_env.common.stats import FloatArray


def maximize(optimizer: CMA, value: Callable[..., FloatArray], *args: Any) -> FloatArray:
    """Draw a generation of vectors, update the optimizer with their values, and return the values.

    Args:
        optimizer: the optimizer of cmaes.
        value: takes vectors, shape (population, size), and ``args``. It returns what is maximized, shape
            (population,), or (population, flocks) if that is the mean over flocks.
        *args: further arguments of ``value``.
    """
    vectors = np.array([optimizer.ask() for _ in range(optimizer.population_size)])
    values = value(vectors, *args)
    fitness = values.reshape(len(vectors), -1).mean(axis=1)
    optimizer.tell(list(zip(vectors, -fitness, strict=True)))  # cmaes minimizes
    return values


def growing(first: int, last: int, share: float) -> int:
    """Return the flocks per vector after a share of a search, which grow geometrically to ``last``.

    Later generations need more flocks, because their policies differ by less than the noise.
    """
    return round(first * float((last / first) ** share))
