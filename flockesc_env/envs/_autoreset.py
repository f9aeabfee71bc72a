"""Autoreset modes of the vector environments: what happens after the end of an episode.

| mode | the step that ends the episode | the next step |
|---|---|---|
| ``NEXT_STEP`` | returns the last observation | ignores the action, returns reward 0, starts an episode |
| ``SAME_STEP`` | starts an episode; the infos contain the last observation | steps the new episode |
| ``DISABLED`` | returns the last observation | raises ``ResetNeededError`` |

The environments for stable-baselines3 use ``SAME_STEP``.
"""

from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.episodes.batch import AtEnd, Columns, FlockBatch, Observations, is_over


class Ending(NamedTuple):
    """The episodes that ended in a step under ``SAME_STEP``."""

    rows: NDArray[np.bool]  # whether the episode of each row's flock has ended, shape (f * rows,)
    observations: Observations  # last observations, one per row of an ended episode
    started: Columns  # columns of `info` of the new episodes, one entry per ended flock


class VectorStep(NamedTuple):
    """The result of one step of f flocks; arrays have shape (f * rows,) unless stated otherwise."""

    observations: Observations  # shape (f * rows, entries)
    rewards: FloatArray
    terminations: NDArray[np.bool]  # whether the episode has ended and the row's agents are caught
    truncations: NDArray[np.bool]  # whether the episode has ended and they are not all caught
    ranges: FloatArray  # in m
    columns: Columns  # of `info` after the step, before any reset, one entry per flock
    active: NDArray[np.bool] | None  # whether the row's agent is not caught; None if none can be caught
    ending: Ending | None  # the episodes that ended, under `SAME_STEP`


def step(
    batch: FlockBatch, actions: Any, mode: AutoresetMode, out: tuple[Observations, FloatArray] | None = None
) -> VectorStep:
    """Step all flocks of a batch and start new episodes according to the autoreset mode."""
    # Under `SAME_STEP` an episode has ended before a step only if Ctrl-C came between its end and the reset.
    at_end: AtEnd = "refuse" if mode is AutoresetMode.DISABLED else "restart"
    if mode is AutoresetMode.SAME_STEP:  # a reset after the step must not fail
        batch.core.draw_next(range(batch.num_flocks))
    observations, rewards, ended, ranges, columns = batch.step(actions, at_end=at_end, out=out)
    rows = np.repeat(ended, batch.rows)
    active = ~batch.core.caught().ravel() if batch.rows_can_be_caught else None
    terminations = np.repeat(is_over(columns), batch.rows) if active is None else rows & ~active
    truncations = rows & ~terminations
    if active is None and batch.max_actions is not None:
        # `TimeLimit` also truncates an episode that terminates in its last action.
        truncations |= batch.core.reached_limit().repeat(batch.rows)
    ending = None
    if mode is AutoresetMode.SAME_STEP and ended.any():
        last = observations[rows]
        observations[rows], started = batch.reset(np.flatnonzero(ended).tolist())
        ending = Ending(rows, last, started)
    return VectorStep(observations, rewards, terminations, truncations, ranges, columns, active, ending)
