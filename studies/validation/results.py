"""The parts of the study, their verdicts, and the record of their results."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Protocol, Self, cast, get_type_hints

import msgspec

from flockesc_env.jobs import Arrays, Job
from studies.study import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PARTS: Final[tuple[str, ...]] = (
    "vicsek",
    "predator_ring",
    "criticality",
    "milling",
)
"""Modules of this package, in the order of the page. Each measures one published result."""


class Verdict(StrEnum):
    """Whether the result here agrees with the published one, by the rule of its part."""

    AGREES = "agrees"
    DIFFERS = "differs"


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


@dataclass(frozen=True)
class Measured:
    """Results of a part, with the command that measured them and its processor minutes."""

    command: str
    versions: dict[str, str]
    minutes: float
    results: Any


@dataclass(frozen=True)
class ValidationResults(Results):
    """Results by part; parts that were not measured are missing."""

    parts: dict[str, Measured]

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Build results from their JSON document."""
        found = msgspec.json.decode(text, type=cls)
        return cls({name: _typed(name, found.parts[name]) for name in PARTS if name in found.parts})


def _typed(name: str, measured: Measured) -> Measured:
    kind = get_type_hints(part(name).results)["return"]
    return dataclasses.replace(measured, results=msgspec.convert(measured.results, kind))
