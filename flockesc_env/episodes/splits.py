"""Disjoint ranges of seeds for tuning, held-out evaluation and training.

Environments give seeds of 2^32 or more to the episodes that autoreset starts (``flockesc_env.episode_seed``),
above all of these ranges.
"""

from flockesc_env.common.checks import as_count
from flockesc_env.common.errors import InputError

TUNING = range(1_000_000, 2_000_000)
"""Flocks for choosing the best fixed range, hyperparameters and checkpoints."""

HELD_OUT = range(2_000_000, 3_000_000)
"""Flocks for reported results only."""

TRAINING = range(3_000_000, 1_003_000_000)
"""Flocks for training runs."""

FLOCKS_PER_RUN = 1_000_000


def training_seeds(seed: int, first: int, count: int) -> range:
    """Return the seeds of ``count`` flocks of the training run ``seed``, from its flock ``first`` on."""
    run = as_count(seed, "seed", least=0, most=len(TRAINING) // FLOCKS_PER_RUN - 1)
    if first < 0 or count < 1 or first + count > FLOCKS_PER_RUN:
        given = f"[{first}, {first + count})"
        raise InputError("flocks of a run", f"indices in [0, {FLOCKS_PER_RUN})", given)
    start = TRAINING.start + run * FLOCKS_PER_RUN + first
    return range(start, start + count)


def first_seeds(purpose: range, count: int) -> range:
    """Return the first ``count`` seeds of ``TUNING`` or ``HELD_OUT``."""
    return purpose[: as_count(count, "flocks", most=len(purpose))]
