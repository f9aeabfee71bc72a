"""Seeds of episodes: ``episode_seed``, the seed schedule that all environments follow."""

from __future__ import annotations

import secrets

from flockesc_env import _core
from flockesc_env.common.checks import as_seed


def episode_seed(seed: int, episode: int) -> int:
    """Return the seed of the ``episode``-th episode of an environment after ``reset(seed=seed)``.

    Episode 0 is the episode that this reset starts; its seed is ``seed`` itself. Resets without a seed and
    autoreset start the later episodes. Their seeds are in [2^32, 2^63), so they never coincide with seeds
    below 2^32: flocks with small seeds can be held out for evaluation.

    Args:
        seed: seed passed to ``reset``, an integer in [0, 2^64).
        episode: index of the episode, an integer in [0, 2^64).

    Raises:
        InputError: if an argument is not an integer in [0, 2^64).
    """
    return _core.episode_seed(as_seed(seed), as_seed(episode, "episode"))


def fresh_seed() -> int:
    """Return a random seed in [2^32, 2^63) from the operating system."""
    return episode_seed(secrets.randbits(64), 1)


def consecutive_seeds(first: int, count: int) -> range:
    """Return the seeds of ``count`` flocks: ``first``, ``first + 1``, .."""
    first = as_seed(first)
    return range(first, as_seed(first + count - 1, "seed of the last flock") + 1)
