"""Which flocks are for what: ranges of seeds that never meet.

Later episodes of a training run's environments have seeds of 2^32 or more (``flockesc_env.episode_seed``),
far beyond all of these.
"""

TUNING = range(1_000_000, 2_000_000)
"""Flocks on which anything may be chosen: the best fixed range, hyperparameters, a checkpoint."""

HELD_OUT = range(2_000_000, 3_000_000)
"""Flocks on which results are reported, and nothing else."""

TRAINING = range(3_000_000, 1_003_000_000)
"""Flocks of training runs."""

TUNING_RUN = 999
"""Seed of the training runs by which hyperparameters are chosen; no reported run has it."""

FLOCKS_PER_RUN = 1_000_000


def training_seeds(seed: int, first: int, count: int) -> range:
    """Return the seeds of some flocks of a training run.

    Args:
        seed: of the run; its flocks are no other run's.
        first: number of the first flock.
        count: how many flocks.

    Raises:
        ValueError: if they would leave the run's part of ``TRAINING``.
    """
    runs = len(TRAINING) // FLOCKS_PER_RUN
    if not 0 <= seed < runs:
        raise ValueError(f"seed: expected 0 to {runs - 1}, got {seed}")
    if first < 0 or count < 1 or first + count > FLOCKS_PER_RUN:
        raise ValueError(f"flocks of a run: expected 1 to {FLOCKS_PER_RUN}, got {first} to {first + count}")
    start = TRAINING.start + seed * FLOCKS_PER_RUN + first
    return range(start, start + count)


def first_seeds(purpose: range, count: int) -> range:
    """Return the first ``count`` seeds of ``TUNING`` or ``HELD_OUT``.

    Raises:
        ValueError: if there are not as many.
    """
    if not 1 <= count <= len(purpose):
        raise ValueError(f"flocks: expected 1 to {len(purpose)}, got {count}")
    return purpose[:count]
