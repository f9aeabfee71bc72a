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

from flockesc_env.common.checks import FloatArray, as_array
from flockesc_env.common.errors import ResetNeededError
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
    batch: FlockBatch,
    actions: Any,
    mode: AutoresetMode,
    out: tuple[Observations, FloatArray] | None = None,
    limit: int | None = None,
) -> VectorStep:
    """Step all flocks of a batch and start new episodes according to the autoreset mode.

    ``limit`` is the number of actions after which an episode is truncated; ``None``: no limit.
    """
    # Under `SAME_STEP` an episode has ended before a step only if Ctrl-C came between its end and the reset.
    at_end: AtEnd = "refuse" if mode is AutoresetMode.DISABLED else "restart"
    limited = [] if limit is None else _limited(batch, limit, at_end)
    if limited:
        actions = _with_valid_rows(batch, actions, limited)
    # A reset after the step must not fail: the next episodes are drawn before.
    batch.core.check_next(range(batch.num_flocks) if mode is AutoresetMode.SAME_STEP else limited)
    observations, rewards, ended, ranges, columns = batch.step(actions, at_end=at_end, out=out)
    if limited:  # the core has stepped these flocks, whose next episodes begin here
        rows = _rows(batch, limited)
        observations[rows], started = batch.reset(limited)
        rewards[rows] = ranges[rows] = ended[limited] = 0
        for name, column in started.items():
            columns[name][limited] = column
    has_reached_limit = None if limit is None else _actions_taken(batch) >= limit
    if has_reached_limit is not None:
        ended |= has_reached_limit
    rows = np.repeat(ended, batch.rows)
    active = ~batch.core.caught().ravel() if batch.rows_can_be_caught else None
    terminations = np.repeat(is_over(columns), batch.rows) if active is None else rows & ~active
    truncations = rows & ~terminations
    if active is None and has_reached_limit is not None:  # also if the episode terminates, as by `TimeLimit`
        truncations |= has_reached_limit.repeat(batch.rows)
    ending = None
    if mode is AutoresetMode.SAME_STEP and ended.any():
        last = observations[rows]
        observations[rows], started = batch.reset(np.flatnonzero(ended).tolist())
        ending = Ending(rows, last, started)
    return VectorStep(observations, rewards, terminations, truncations, ranges, columns, active, ending)


def _actions_taken(batch: FlockBatch) -> FloatArray:
    """Return the number of actions of every episode, from the time, which counts up to 2^23 model steps."""
    times = batch.core.observe(range(batch.num_flocks), "flock")[:, 0]
    steps = np.rint(times * [scenario.num_steps for scenario in batch.scenarios])
    return np.ceil(steps / batch.options.steps_per_action)


def _limited(batch: FlockBatch, limit: int, at_end: AtEnd) -> list[int]:
    """Return the flocks whose episode only the limit has ended, which the core does not know."""
    flocks = np.flatnonzero(_actions_taken(batch) >= limit).tolist()
    flocks = [flock for flock in flocks if not batch.core.has_ended(flock)]
    if flocks and at_end == "refuse":
        raise ResetNeededError(f"step() called after the end of flock {flocks[0]}'s episode; call reset()")
    return flocks


def _with_valid_rows(batch: FlockBatch, actions: Any, flocks: list[int]) -> Any:
    """Return actions whose entries for some flocks, which are ignored, are replaced by valid ones."""
    given, rows, space = as_array(actions, "action"), _rows(batch, flocks), batch.policy_spec.actions
    if given.size != len(rows) or given.dtype.kind not in "fiu":
        return actions
    valid = space.from_ranges(np.array([space.min_range])).squeeze()
    return np.where(rows.reshape(given.shape), valid, given)


def _rows(batch: FlockBatch, flocks: list[int]) -> NDArray[np.bool]:
    return np.isin(np.arange(batch.num_flocks), flocks).repeat(batch.rows)
