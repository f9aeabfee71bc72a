"""Autoreset modes of the vector environments: what happens after the end of an episode.

| mode | the step that ends the episode | the next step |
|---|---|---|
| ``NEXT_STEP`` | returns the last observation | ignores the action, returns reward 0, starts an episode |
| ``SAME_STEP`` | starts an episode; the infos contain the last observation | steps the new episode |
| ``DISABLED`` | returns the last observation | raises ``ResetNeededError`` |

The environments for stable-baselines3 use ``SAME_STEP``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.episodes.batch import AtEnd, Columns, FlockBatch, Observations, is_over


class Ending(NamedTuple):
    """The episodes that ended in a step under ``SAME_STEP``.

    Attributes:
        slots: indices of the flocks.
        observations: last observations, shape (len(slots) * rows, entries).
        caught: whether each agent was caught, shape (len(slots), n).
        started: columns of ``info`` of the new episodes.
    """

    slots: list[int]
    observations: Observations
    caught: NDArray[np.bool]
    started: Columns


class VectorStep(NamedTuple):
    """The result of one step of f flocks.

    Attributes:
        observations: shape (f * rows, entries).
        rewards: shape (f * rows,).
        ended: whether each flock's episode has ended, shape (f,).
        terminations: whether it ended because all agents are caught, shape (f,); otherwise it is truncated.
        ranges: interaction ranges in m, shape (f * rows,).
        columns: columns of ``info`` after the step, before any reset.
        ending: the episodes that ended, under ``SAME_STEP``; ``None`` in other modes or if none ended.
    """

    observations: Observations
    rewards: FloatArray
    ended: NDArray[np.bool]
    terminations: NDArray[np.bool]
    ranges: FloatArray
    columns: Columns
    ending: Ending | None


def step(
    batch: FlockBatch,
    actions: Any,
    mode: AutoresetMode,
    out: tuple[Observations, FloatArray] | None = None,
) -> VectorStep:
    """Step all flocks of a batch and start new episodes according to the autoreset mode.

    Args:
        batch: the flocks.
        actions: stacked actions, see ``FlockBatch.step``.
        mode: the autoreset mode.
        out: arrays that receive the observations and rewards; ``None``: new arrays.

    Raises:
        ActionError: if an action is outside the action space.
        ResetNeededError: if a flock was never reset, or if its episode has ended under ``DISABLED``.
    """
    at_end: AtEnd = "restart" if mode is AutoresetMode.NEXT_STEP else "refuse"
    observations, rewards, ended, ranges, columns = batch.step(actions, at_end=at_end, out=out)
    terminations = is_over(columns)
    ending = None
    if mode is AutoresetMode.SAME_STEP and ended.any():
        slots = np.flatnonzero(ended).tolist()
        rows = np.repeat(ended, batch.rows)
        last, caught = observations[rows], batch.caught()[ended]
        observations[rows], started = batch.reset(slots)
        ending = Ending(slots, last, caught, started)
    return VectorStep(observations, rewards, ended, terminations, ranges, columns, ending)
