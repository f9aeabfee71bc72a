"""Which seed an episode has: one schedule, which every environment follows."""

from __future__ import annotations

import secrets

from flockesc_env import _core
from flockesc_env._checks import as_seed


def episode_seed(seed: int, episode: int) -> int:
    """Return the seed of the ``episode``-th episode of an environment after ``reset(seed=seed)``.

    Episode 0 is the one that this reset starts, with ``seed`` itself; later ones are started by resets
    without a seed, or by autoreset, and have seeds in [2^32, 2^63). So a smaller seed, such as people name,
    never comes up by chance, and flocks held out for a report cannot slip into training.

    Raises:
        ArgumentError: for a number that is no integer from 0 to 2^64 - 1.
    """
    return _core.episode_seed(as_seed(seed), as_seed(episode, "episode"))


def fresh_seed() -> int:
    """Return a seed in [2^32, 2^63) that the operating system draws."""
    return episode_seed(secrets.randbits(64), 1)


class EpisodeSeeds:
    """The seeds of one environment's episodes; the operating system draws the first that is not given."""

    def __init__(self) -> None:
        self._seed = fresh_seed()
        self._episode = 0

    @property
    def place(self) -> tuple[int, int]:
        """Seed of the schedule, and number of its next episode."""
        return self._seed, self._episode

    @place.setter
    def place(self, place: tuple[int, int]) -> None:
        self._seed, self._episode = place

    def next(self, seed: int | None = None) -> int:
        """Return the seed of the next episode; ``seed`` starts the schedule anew."""
        if seed is not None:
            self._seed, self._episode = seed, 0
        self._episode += 1
        return episode_seed(self._seed, self._episode - 1)
