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

    ``value`` is the objective under it. The gains over both ends of the grid are paired flock by flock.
    """

    best: Estimate
    index: int
    value: Estimate
    gain_over_zero: Estimate
    gain_over_longest: Estimate

    @property
    def finding(self) -> Finding:
        """The finding by ``RULE``."""
        return _finding(self.gain_over_zero, self.gain_over_longest)


def choose(actions: tuple[float, ...], values: FloatArray) -> Choice:
    """Choose the best action of a grid; ``values`` holds the objective, shape (actions, flocks)."""
    half = values.shape[1] // 2
    measured = values[:, half:]
    best = stats.argmax(np.array(actions), values[:, :half])
    at = actions.index(best.mean)
    over_zero, over_longest = (stats.mean(measured[at] - measured[end]) for end in (0, -1))
    return Choice(best, at, stats.mean(measured[at]), over_zero, over_longest)


def _finding(over_zero: Estimate, over_longest: Estimate) -> Finding:
    if over_zero.low > 0:
        return Finding.INTERIOR if over_longest.low > 0 else Finding.LIKE_LONGEST
    return Finding.LIKE_ZERO if over_longest.low > 0 else Finding.LIKE_BOTH


@dataclass(frozen=True)
class Outcome:
    """The best fixed range for one objective; lengths in m, ranges in the grid's unit.

    ``best`` is chosen on the first half of the flocks. Everything else is measured on the second half: both
    objectives at that range; the objective at both ends of the grid, the paired gains over them, and the
    objective at every range.
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
        """The finding by ``RULE``."""
        return _finding(self.gain_over_zero, self.gain_over_longest)


def outcome(symbol: str, actions: tuple[float, ...], results: Mapping[str, NDArray[Any]]) -> Outcome:
    """Return the outcome for an objective; results have the shape (actions, flocks), flocks in two halves."""
    values = results[OBJECTIVES[symbol]]
    half = values.shape[1] // 2
    choice, curve = choose(actions, values), tuple(stats.mean(row) for row in values[:, half:])
    reached = {name: stats.mean(results[name][choice.index, half:]) for name in OBJECTIVES.values()}
    return Outcome(
        best=choice.best,
        **reached,
        at_zero=curve[0],
        at_longest=curve[-1],
        gain_over_zero=choice.gain_over_zero,
        gain_over_longest=choice.gain_over_longest,
        curve=curve,
    )
