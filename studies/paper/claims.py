"""A claim of the paper beside what was measured, and the rule that turns both into a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray


class Verdict(StrEnum):
    """Whether a claim of the paper holds."""

    HOLDS = "holds"
    IN_EXPECTATION = "holds in expectation only"
    SOMETIMES = "holds for some realizations"
    FAILS = "does not hold"


MOST = 0.95
"""Share of realizations from which on a claim holds as such."""


def verdict(share: float, *, in_expectation: bool) -> Verdict:
    """Return the verdict on a claim.

    Args:
        share: share of realizations in which it is true.
        in_expectation: whether it is true of the mean over realizations.
    """
    if in_expectation:
        return Verdict.HOLDS if share >= MOST else Verdict.IN_EXPECTATION
    return Verdict.SOMETIMES if share > 0 else Verdict.FAILS


@dataclass(frozen=True)
class Quantity:
    """A measured quantity.

    Attributes:
        what: what was measured.
        value: the estimate with its 95 % interval.
        unit: ``"m"``, ``"%"`` (``value`` is then a share) or nothing.
        digits: decimals that are shown.
    """

    what: str
    value: Estimate
    unit: str = ""
    digits: int = 2

    def __str__(self) -> str:
        scale, unit = (100, " %") if self.unit == "%" else (1, f" {self.unit}" if self.unit else "")
        mean, low, high = (
            f"{scale * part:.{self.digits}f}" for part in (self.value.mean, self.value.low, self.value.high)
        )
        is_exact = self.value.low == self.value.high
        return f"{self.what}: {mean}{unit}" + ("" if is_exact else f" [{low}, {high}]")


def every(is_so: NDArray[np.bool], axis: int) -> NDArray[np.bool]:
    """Return where something is true along a whole axis."""
    result: NDArray[np.bool] = np.all(is_so, axis=axis)
    return result


def share(what: str, is_so: NDArray[np.bool]) -> Quantity:
    """Return the share of realizations of which something is true."""
    return Quantity(what, stats.share(is_so), "%", 1)


def mean(what: str, values: FloatArray, unit: str = "", digits: int = 2) -> Quantity:
    """Return the mean over realizations."""
    return Quantity(what, stats.mean(values), unit, digits)


def exactly(what: str, value: float, unit: str = "", digits: int = 2) -> Quantity:
    """Return an exact quantity, without an interval."""
    return Quantity(what, Estimate(float(value), float(value), float(value)), unit, digits)


def quantiles(what: str, values: FloatArray, unit: str = "", digits: int = 2) -> Quantity:
    """Return the median and, instead of an interval, the range of 95 % of the realizations."""
    low, middle, high = np.quantile(values, [0.025, 0.5, 0.975])
    return Quantity(what, Estimate(float(middle), float(low), float(high)), unit, digits)


@dataclass(frozen=True)
class RangeRow:
    """What a fixed range gives in expectation.

    Attributes:
        interaction_range: rho in m.
        min_mean_distance: J_mean in m.
        min_min_distance: J_min in m.
        num_components: components at 12 s.
    """

    interaction_range: float
    min_mean_distance: Estimate
    min_min_distance: Estimate
    num_components: Estimate


@dataclass(frozen=True)
class Claim:
    """One row of the page.

    Attributes:
        where: section or figure of the paper.
        claim: what the paper says, with its number.
        measured: this project's figures.
        trials: realizations that they are taken over.
        holds_if: the rule: what has to be true of a realization, and of the mean.
        verdict: what came of it.
    """

    where: str
    claim: str
    measured: tuple[Quantity, ...]
    trials: int
    holds_if: str
    verdict: Verdict
