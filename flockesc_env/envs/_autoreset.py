"""The autoreset rule of vector environments: what happens to a flock whose episode has ended.

| mode | in the step that ends the episode | in the next step |
|---|---|---|
| ``NEXT_STEP`` | returns the last observation | ignores the action, rewards 0, starts the next episode |
| ``SAME_STEP`` | starts the next episode; the last observation goes to the infos | steps the new episode |
| ``DISABLED`` | returns the last observation | raises ``ResetNeededError`` |

Stable-baselines3 follows ``SAME_STEP``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.episodes.batch import AtEnd, Columns, FlockBatch, Observations, is_over


class Ending(NamedTuple):
    """Episodes that have ended in a step which has already started the next ones.

    Attributes:
        slots: indices of the flocks.
        observations: their last observations, shape (slots * rows, entries).
        caught: which agents had been caught, bool of shape (slots, n).
        started: columns of ``info`` of the new episodes.
    """

    slots: list[int]
    observations: Observations
    caught: NDArray[np.bool]
    started: Columns


class VectorStep(NamedTuple):
    """One step of all flocks; f is the number of flocks.

    Attributes:
        observations: shape (f * rows, entries).
        rewards: shape (f * rows,).
        ended: whether each flock's episode has ended, shape (f,).
        terminations: whether it ended because all agents are caught; otherwise it is truncated, shape (f,).
        ranges: in m, shape (f * rows,).
        columns: ``info`` after the step, before any reset.
        ending: the episodes that have ended, under ``SAME_STEP``; ``None``: none has.
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
    """Step all flocks of a batch and apply the autoreset rule.

    Args:
        batch: the flocks.
        actions: as in ``FlockBatch.step``.
        mode: the rule.
        out: as in ``FlockBatch.step``.

    Raises:
        ActionError: as ``FlockBatch.step``.
        ResetNeededError: as ``FlockBatch.step``.
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
