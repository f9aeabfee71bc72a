"""CMA-ES, the evolution strategy that all searches share.

Hansen, "The CMA Evolution Strategy: A Tutorial" (2016), in the implementation of the library cmaes.
"""

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
from cmaes import CMA

from flockesc_env.common.stats import FloatArray
from training.families import Networks, Rules
from training.rounds import Rounds


def maximize(optimizer: CMA, value: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Draw a generation of vectors, update the optimizer with their values, and return the values.

    ``value`` takes vectors, shape (population, size). It returns what is maximized, shape (population,), or
    (population, flocks) if that is the mean over flocks.
    """
    vectors = np.array([optimizer.ask() for _ in range(optimizer.population_size)])
    values = value(vectors)
    fitness = values.reshape(len(vectors), -1).mean(axis=1)
    optimizer.tell(list(zip(vectors, -fitness, strict=True)))  # cmaes minimizes
    return values


def generation(
    rounds: Rounds[Any], family: Networks | Rules, optimizer: CMA, flocks: range
) -> tuple[FloatArray, CMA]:
    """Play a generation of policies on the same flocks and count it; return the values and the optimizer."""

    def play(vectors: FloatArray) -> FloatArray:
        values, num_actions = family.play(vectors, flocks)
        rounds.measured.episodes += values.size
        rounds.measured.samples += num_actions
        return values

    entropy = np.random.SeedSequence([rounds.run.seed, rounds.completed])
    optimizer.reseed_rng(int(entropy.generate_state(1)[0]))
    values = maximize(optimizer, play)
    # A checkpoint stores one triangle of the covariance matrix. The copy does the same, so that interrupted
    # and uninterrupted runs give the same numbers.
    return values, deepcopy(optimizer)
