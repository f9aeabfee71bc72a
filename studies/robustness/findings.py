"""The best fixed range of a preset, its gains, and the rule that judges it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from studies.paper.plan import PAPER_OBJECTIVES

OBJECTIVES = {spec.symbol: spec.column for spec in PAPER_OBJECTIVES}
"""Symbol and column of every objective."""


class Finding(StrEnum):
    """Whether the best fixed range is interior, or over which ends of the grid it has no gain."""

    INTERIOR = "interior"
    LIKE_ZERO = "no gain over 0"
    LIKE_LONGEST = "no gain over the longest"
    LIKE_BOTH = "no gain over either end"


RULE = (
    "a best range is *interior* if it gains over range 0 and over the longest range on the second half of the"
    " flocks. The 95 % intervals of both paired gains must lie above 0. Otherwise the page names the ends of"
    " the grid over which it has no such gain"
)


@dataclass(frozen=True)
class Choice:
    """The best action of a grid, chosen on the first half of the flocks and measured on the second.

    Attributes:
        best: the action with the largest mean over the first half, with its bootstrap interval.
        index: its place in the grid.
        value: the objective under it.
        gain_over_zero: the objective under it minus that under the first action, paired flock by flock.
        gain_over_longest: likewise over the last action.
    """

    best: Estimate
    index: int
    value: Estimate
    gain_over_zero: Estimate
    gain_over_longest: Estimate

    @property
    def finding(self) -> Finding:
        """Return the finding by ``RULE``."""
        return _finding(self.gain_over_zero, self.gain_over_longest)


def choose(actions: tuple[float, ...], values: FloatArray) -> Choice:
    """Choose the best action of a grid; ``values`` holds the objective, shape (actions, flocks)."""
    half = values.shape[1] // 2
    chosen, measured = values[:, :half], values[:, half:]
    best = stats.argmax(np.array(actions), chosen)
    at = actions.index(best.mean)
    return Choice(
        best=best,
        index=at,
        value=stats.mean(measured[at]),
        gain_over_zero=stats.mean(measured[at] - measured[0]),
        gain_over_longest=stats.mean(measured[at] - measured[-1]),
    )


def _finding(gain_over_zero: Estimate, gain_over_longest: Estimate) -> Finding:
    beats_zero, beats_longest = gain_over_zero.low > 0, gain_over_longest.low > 0
    if beats_zero:
        return Finding.INTERIOR if beats_longest else Finding.LIKE_LONGEST
    return Finding.LIKE_ZERO if beats_longest else Finding.LIKE_BOTH


@dataclass(frozen=True)
class Outcome:
    """The best fixed range for one objective; lengths in m, ranges in the grid's unit.

    Attributes:
        best: the range with the largest mean over the first half of the flocks, with its bootstrap interval.
            Everything else is measured on the second half.
        min_mean_distance: J_mean at that range.
        min_min_distance: J_min at that range.
        at_zero: the objective at range 0.
        at_longest: the objective at the longest range of the grid.
        gain_over_zero: the objective at the best range minus that at 0, paired flock by flock.
        gain_over_longest: likewise over the longest range.
        curve: the objective at every range of the grid.
    """

    best: Estimate
    min_mean_distance: Estimate
    min_min_distance: Estimate
    at_zero: Estimate
    at_longest: Estimate
    gain_over_zero: Estimate
    gain_over_longest: Estimate
    curve: tuple[Estimate, ...]

    def value(self, symbol: str) -> Estimate:
        """Return an objective, a key of ``OBJECTIVES``, at the best range."""
        value: Estimate = getattr(self, OBJECTIVES[symbol])
        return value

    @property
    def finding(self) -> Finding:
        """Return the finding by ``RULE``."""
        return _finding(self.gain_over_zero, self.gain_over_longest)


def outcome(symbol: str, actions: tuple[float, ...], results: Mapping[str, NDArray[Any]]) -> Outcome:
    """Choose the best range on the first half of the flocks, and measure it on the second.

    Args:
        symbol: a key of ``OBJECTIVES``.
        actions: the grid, from 0 to the longest.
        results: J of both objectives, shape (actions, flocks), an even number of flocks.
    """
    half = results["num_components"].shape[1] // 2
    values = results[OBJECTIVES[symbol]]
    measured = values[:, half:]
    choice = choose(actions, values)
    return Outcome(
        best=choice.best,
        min_mean_distance=stats.mean(results["min_mean_distance"][choice.index, half:]),
        min_min_distance=stats.mean(results["min_min_distance"][choice.index, half:]),
        at_zero=stats.mean(measured[0]),
        at_longest=stats.mean(measured[-1]),
        gain_over_zero=choice.gain_over_zero,
        gain_over_longest=choice.gain_over_longest,
        curve=tuple(stats.mean(row) for row in measured),
    )
