"""``FlockView`` and ``LineView``: read-only access to the state of an environment."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray
from flockesc_env.common.errors import ResetNeededError
from flockesc_env.episodes.batch import FlockBatch


def _entry(name: str) -> Any:
    """Return a property for an entry of the state of a flock."""
    return property(lambda view: _frozen(view._batch.core.state(view._slot)[name]))


class FlockView:
    """The current state of one flock. Array properties return new, read-only arrays.

    Before ``reset`` the properties raise ``ResetNeededError``.
    """

    positions: FloatArray = _entry("positions")
    """Positions of the agents in m, shape (n, D)."""
    velocities: FloatArray = _entry("velocities")
    """Velocities of the agents in m/s, shape (n, D)."""
    distances: FloatArray = _entry("distances")
    """Distance of every agent to the nearest predator in m, shape (n,); 0 for caught agents."""
    interaction_range: FloatArray = _entry("interaction_range")
    """Last ranges in m, shape (n,) with one range per agent, else (1,); 0 after ``reset``."""
    predator_positions: FloatArray = _entry("predator_positions")
    """Positions of the predators in m, shape (P, D)."""
    predator_velocities: FloatArray = _entry("predator_velocities")
    """Velocities of the predators in m/s, shape (P, D)."""

    def __init__(self, batch: FlockBatch, slot: int = 0) -> None:
        self._batch = batch
        self._slot = slot

    @property
    def step(self) -> int:
        """Number of steps of the model since the start of the episode."""
        return int(self._batch.core.state(self._slot)["step"])

    @property
    def caught(self) -> NDArray[np.bool]:
        """Whether each agent has been caught, shape (n,)."""
        return _frozen(self._batch.core.caught()[self._slot])


class LineView:
    """The current state of a line. Before ``reset``, there is none: ``ResetNeededError`` is raised."""

    def __init__(self, episode: _core.LineEpisode | None) -> None:
        if episode is None:
            raise ResetNeededError("line accessed before reset()")
        self._episode = episode

    @property
    def step(self) -> int:
        """Number of steps of the model since the start of the episode."""
        return int(self._episode.get("steps"))

    @property
    def states(self) -> FloatArray:
        """States x of the agents, shape (n,), read-only."""
        return _frozen(self._episode.get("states"))

    @property
    def interaction_range(self) -> float:
        """Range of the last action; 0 after ``reset``."""
        return float(self._episode.get("interaction_range"))


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array
