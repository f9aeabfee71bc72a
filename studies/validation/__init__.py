"""The parts of the study: modules of this package, found by name, and what they have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Protocol, cast

from flockesc_env.jobs import Arrays, Job

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PARTS: Final[tuple[str, ...]] = (
    "warning",
    "vicsek",
    "predator_ring",
    "criticality",
    "milling",
    "stable_range",
)
"""Modules in the order of the page. Each measures one published result; the last answers an open question."""


class Verdict(StrEnum):
    """Whether the result here agrees with the published one, by the rule of its part."""

    AGREES = "agrees"
    DIFFERS = "differs"
    CANNOT_BE_JUDGED = "cannot be judged"

    @classmethod
    def of(cls, *conditions: object) -> Verdict:
        """Return the verdict: a result agrees if all conditions are true."""
        return cls.AGREES if all(conditions) else cls.DIFFERS


class Part(Protocol):
    """A module of ``PARTS``. ``templates/<module>.md`` is its section, which gets the module as ``part``."""

    TITLE: str
    PUBLISHED: str

    def jobs(self, scale: float) -> Mapping[Any, Job | Sequence[Job]]:
        """Return the jobs by key, for a share of the page's flocks."""

    def results(self, measured: Mapping[Any, Arrays]) -> Any:
        """Return the results of the jobs: a frozen dataclass, which the annotation names."""

    def here(self, results: Any) -> str:
        """Return the result here, for the overview."""

    def verdict(self, results: Any) -> Verdict:
        """Return the verdict by a rule on intervals."""

    def figure(self, results: Any) -> Figure:
        """Draw the published result and the one here."""


def part(name: str) -> Part:
    """Return a module of ``PARTS``."""
    return cast("Part", import_module(f"studies.validation.{name}"))


def scaled(count: int, scale: float, least: int = 4) -> int:
    """Return a share of a number of flocks, at least ``least``."""
    return max(least, round(count * scale))
