"""``FlockView`` and ``LineView``: read-only access to the state of an environment."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray
from flockesc_env.common.errors import ResetNeededError
from flockesc_env.episodes.batch import FlockBatch


class FlockView:
    """The current state of one flock. Array properties return new, read-only arrays.

    Before ``reset`` the properties raise ``ResetNeededError``.
    """

    def __init__(self, batch: FlockBatch, slot: int = 0) -> None:
        self._batch = batch
        self._slot = slot

    def __repr__(self) -> str:
        return f"FlockView(slot={self._slot})"

    @property
    def step(self) -> int:
        """Number of steps of the model since the start of the episode."""
        return int(self._batch.core.state(self._slot)["step"])

    @property
    def positions(self) -> FloatArray:
        """Positions of the agents in m, shape (n, D)."""
        return self._array("positions")

    @property
    def velocities(self) -> FloatArray:
        """Velocities of the agents in m/s, shape (n, D)."""
        return self._array("velocities")

    @property
    def distances(self) -> FloatArray:
        """Distance of every agent to the nearest predator in m, shape (n,); 0 for caught agents."""
        return self._array("distances")

    @property
    def caught(self) -> NDArray[np.bool]:
        """Whether each agent has been caught, shape (n,)."""
        return _frozen(self._batch.core.caught()[self._slot])

    @property
    def interaction_range(self) -> FloatArray:
        """Last ranges in m, shape (n,) with one range per agent, else (1,); 0 after ``reset``."""
        return self._array("interaction_range")

    @property
    def predator_positions(self) -> FloatArray:
        """Positions of the predators in m, shape (P, D)."""
        return self._array("predator_positions")

    @property
    def predator_velocities(self) -> FloatArray:
        """Velocities of the predators in m/s, shape (P, D)."""
        return self._array("predator_velocities")

    def _array(self, name: str) -> FloatArray:
        return _frozen(self._batch.core.state(self._slot)[name])


class LineView:
    """The current state of a line. Before ``reset``, there is none: ``ResetNeededError`` is raised."""

    def __init__(self, episode: _core.LineEpisode | None) -> None:
        if episode is None:
            raise ResetNeededError("line accessed before reset()")
        self._episode = episode

    @property
    def step(self) -> int:
        """Number of steps of the model since the start of the episode."""
        return self._episode.steps

    @property
    def states(self) -> FloatArray:
        """States x of the agents, shape (n,), read-only."""
        return _frozen(self._episode.states)

    @property
    def interaction_range(self) -> float:
        """Range of the last action; 0 after ``reset``."""
        return self._episode.interaction_range


def _frozen(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array
