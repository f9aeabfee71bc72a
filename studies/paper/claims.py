"""Claims of the paper, their measurements, and the rule for the verdicts."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray

Bools = NDArray[np.bool]


class Verdict(StrEnum):
    """Whether a claim of the paper holds."""

    HOLDS = "holds"
    IN_EXPECTATION = "holds in expectation only"
    SOMETIMES = "holds for some realizations"
    FAILS = "does not hold"


MOST = 0.95  # a claim holds if it is true in at least this share of the realizations


@dataclass(frozen=True)
class Judgment:
    """The verdict on a claim, and the share of realizations in which it is true.

    ``is_clear`` is False if the sample is too small to judge: an interval includes the bound that decides.
    """

    verdict: Verdict
    share: Estimate
    is_clear: bool


@dataclass(frozen=True)
class Quantity:
    """A measured quantity; its unit is "m", "%" (then ``value`` is a share) or ""."""

    what: str
    value: Estimate
    unit: str = ""
    digits: int = 2

    def __str__(self) -> str:
        return f"{self.what}: {self.text}"

    @property
    def text(self) -> str:
        """The value with its unit and, unless it is exact, its interval."""
        scale, unit = (100, " %") if self.unit == "%" else (1, f" {self.unit}" if self.unit else "")
        value = self.value
        mean, low, high = (f"{scale * part:.{self.digits}f}" for part in (value.mean, value.low, value.high))
        return f"{mean}{unit}" + ("" if value.low == value.high else f" [{low}, {high}]")


def share(what: str, is_so: Bools) -> Quantity:
    """Return the share of realizations in which something is true."""
    return Quantity(what, stats.share(is_so), "%", 1)


def mean(what: str, values: NDArray[np.number], unit: str = "", digits: int = 2) -> Quantity:
    """Return the mean over realizations."""
    return Quantity(what, stats.mean(values.astype(float)), unit, digits)


def exactly(what: str, value: float, unit: str = "", digits: int = 2) -> Quantity:
    """Return an exact quantity, without an interval."""
    return Quantity(what, Estimate(float(value), float(value), float(value)), unit, digits)


def quantiles(what: str, values: FloatArray, unit: str = "", digits: int = 2) -> Quantity:
    """Return the median with the range of 95 % of the realizations instead of an interval."""
    low, middle, high = np.quantile(values, [0.025, 0.5, 0.975])
    return Quantity(what, Estimate(float(middle), float(low), float(high)), unit, digits)


@dataclass(frozen=True)
class Claim:
    """One row of the page: what the paper says at a place, what is measured, and the verdict.

    The first measured quantity is the key figure. ``holds_if`` says what has to be true of a realization, and
    of the mean. A reading is this project's own reading of the text, not a claim of the paper.
    """

    where: str
    claim: str
    measured: tuple[Quantity, ...]
    trials: int
    holds_if: str
    judgment: Judgment
    is_reading: bool = False


@dataclass(frozen=True)
class Expectation:
    """Whether a claim is true of the mean over realizations, and whether the sample is enough to tell."""

    is_so: bool
    is_clear: bool = True


def between(value: Estimate, low: float, high: float) -> Expectation:
    """Return whether a mean lies between two bounds, which is clear if its interval contains neither."""
    is_clear = not any(value.low < bound < value.high for bound in (low, high))
    return Expectation(low <= value.mean <= high, is_clear)


def above_zero(value: Estimate) -> Expectation:
    """Return whether a mean lies above 0, which is clear if its interval does not contain 0."""
    return Expectation(value.mean > 0, not value.low < 0 < value.high)


def claim(
    where: str,
    says: str,
    holds_if: str,
    is_so: Bools,
    *measured: Quantity | str,
    in_expectation: Expectation | bool | np.bool | None = None,
    trials: int | None = None,
    is_reading: bool = False,
) -> Claim:
    """Return a claim from whether it is true of every realization, and of the mean; None: of all of them.

    A string in ``measured`` is the label of the share of realizations for which the claim holds. ``trials``
    defaults to the number of realizations.
    """
    quantities = tuple(share(each, is_so) if isinstance(each, str) else each for each in measured)
    found = stats.share(is_so)
    if not isinstance(in_expectation, Expectation):
        in_expectation = Expectation(bool(is_so.all() if in_expectation is None else in_expectation))
    is_clear, verdict = in_expectation.is_clear, Verdict.SOMETIMES if is_so.any() else Verdict.FAILS
    if in_expectation.is_so:
        verdict = Verdict.HOLDS if is_so.mean() >= MOST else Verdict.IN_EXPECTATION
        is_clear = is_clear and not found.low < MOST <= found.high
    judgment = Judgment(verdict, found, is_clear)
    return Claim(where, says, quantities, trials or len(is_so), holds_if, judgment, is_reading)
