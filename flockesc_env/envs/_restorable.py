"""Environments whose whole state is that of a batch: bytes and back."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from flockesc_env.episodes.batch import FlockBatch, Observations

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer

Seen = TypeVar("Seen")
"""What ``reset`` returns first."""


class Restorable(Generic[Seen]):
    """Saves and restores the one flock of a batch."""

    _batch: FlockBatch
    _viewer: FlockViewer | None

    def get_state(self) -> bytes:
        """Return everything that the future depends on, episodes and seeds of those to come, as bytes.

        They hold for every environment of the same scenario, options and interface, in every process and on
        any number of threads; they name the version of their form, and have a checksum. ``np_random`` and
        the random states of spaces are not part of it: no episode draws from them.

        Raises:
            EpisodeError: before ``reset``.
        """
        return self._batch.get_state()

    def set_state(self, state: bytes) -> Seen:
        """Go on from where an environment was when it returned ``state``; return what is observed there.

        Args:
            state: what ``get_state`` returned, here or elsewhere.

        Raises:
            ArgumentError: for bytes that are damaged, of another version, or of another scenario, other
                options or another interface; the running episode goes on.
        """
        restore(self._batch, self._viewer, state)
        return self._seen_now()

    @abstractmethod
    def _seen_now(self) -> Seen:
        """Take note of where the batch is, and return what is observed there."""


class RestorableBatch:
    """Saves and restores flocks of a batch, all or some."""

    _batch: FlockBatch
    _viewer: FlockViewer | None

    def get_state(self, flocks: Any = None) -> bytes:
        """Return everything that the future of some flocks depends on; see ``FlockEscapeEnv.get_state``.

        Args:
            flocks: index of one flock, or indices of several; ``None``: all.

        Raises:
            ArgumentError: for an index out of bounds.
            EpisodeError: before ``reset``.
        """
        return self._batch.get_state(flocks)

    def set_state(self, state: bytes, flocks: Any = None) -> Observations:
        """Go on from where flocks were when ``state`` was returned; return the observations of all flocks.

        Args:
            state: what ``get_state`` returned, here or elsewhere: of as many flocks, or of one, such as that
                of a single environment, which all ``flocks`` become.
            flocks: index of one flock, or indices of several; ``None``: all.

        Raises:
            ArgumentError: for an index out of bounds, or bytes that are damaged, of another version, scenario
                or interface, other options or another number of flocks; the running episodes go on.
            EpisodeError: before ``reset``, if ``flocks`` leaves some out.
        """
        restore(self._batch, self._viewer, state, flocks)
        return self._batch.observe(range(self._batch.num_flocks))


def restore(batch: FlockBatch, viewer: FlockViewer | None, state: Any, flocks: Any = None) -> None:
    """Make some flocks, or all, what ``state`` is of, and forget the pictures of what they were."""
    slots = batch.set_state(state, flocks)
    if viewer is not None:
        viewer.forget(slots)
        viewer.update()
