"""Environments whose whole state is that of a batch: bytes and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flockesc_env.batch import FlockBatch

if TYPE_CHECKING:
    from flockesc_env.render.viewer import FlockViewer


class Restorable:
    """Saves and restores the one flock, or all flocks, of a batch."""

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

    def _restore(self, state: Any, flocks: Any = None) -> None:
        """Make some flocks, or all, what ``state`` is of, and forget the pictures of what they were."""
        slots = self._batch.set_state(state, flocks)
        if self._viewer is not None:
            self._viewer.forget(slots)
            self._viewer.update()


class RestorableBatch(Restorable):
    """The same of many flocks, one by one, too."""

    def get_state(self, flocks: Any = None) -> bytes:
        """Return everything that the future of some flocks depends on; see ``FlockEscapeEnv.get_state``.

        Args:
            flocks: index of one flock, or indices of several; ``None``: all.

        Raises:
            ArgumentError: for an index out of bounds.
            EpisodeError: before ``reset``.
        """
        return self._batch.get_state(flocks)
