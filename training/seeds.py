"""Which flocks are for what: ranges of seeds that never meet.

Later episodes of a training run have seeds of 2^32 or more (``flockesc_env.episode_seed``), far beyond all
of these.
"""

TUNING = range(1_000_000, 2_000_000)
"""Flocks on which anything may be chosen: the best fixed range, hyperparameters, a checkpoint."""

HELD_OUT = range(2_000_000, 3_000_000)
"""Flocks on which results are reported, and nothing else."""

TRAINING = range(3_000_000, 4_000_000)
"""First episodes of training runs."""

_FLOCKS_PER_RUN = 1_000


def training_seed(seed: int, num_flocks: int) -> int:
    """Return the seed of the first flock of a training run.

    Raises:
        ValueError: if the run would leave the training range.
    """
    if not 1 <= num_flocks <= _FLOCKS_PER_RUN:
        raise ValueError(f"num_flocks: expected 1 to {_FLOCKS_PER_RUN}, got {num_flocks}")
    first = TRAINING.start + seed * _FLOCKS_PER_RUN
    if first not in TRAINING:
        raise ValueError(f"seed: expected 0 to {len(TRAINING) // _FLOCKS_PER_RUN - 1}, got {seed}")
    return first


def first_seeds(purpose: range, count: int) -> range:
    """Return the first ``count`` seeds of ``TUNING`` or ``HELD_OUT``.

    Raises:
        ValueError: if there are not as many.
    """
    if not 1 <= count <= len(purpose):
        raise ValueError(f"flocks: expected 1 to {len(purpose)}, got {count}")
    return purpose[:count]
