"""Which seed an episode has: one schedule, which every environment follows."""

from __future__ import annotations

import secrets
from typing import NamedTuple

from flockesc_env import _core
from flockesc_env.common.checks import as_seed


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


class Schedule(NamedTuple):
    """The seeds of one environment's episodes: that of the first, and the number of the next one."""

    seed: int
    episode: int = 0

    def at(self, seed: int | None, episode: int | None) -> Schedule:
        """Return the schedule of ``seed``, or else this one, before ``episode``, or else the next one."""
        schedule = self if seed is None else Schedule(seed)
        return schedule if episode is None else schedule._replace(episode=episode)

    def after(self) -> Schedule:
        """Return the schedule after its next episode."""
        return self._replace(episode=(self.episode + 1) % 2**64)

    def episode_seed(self) -> int:
        """Return the seed of the next episode."""
        return episode_seed(self.seed, self.episode)
