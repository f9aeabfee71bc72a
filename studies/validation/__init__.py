"""Published results of other models and flocks, measured again with this simulator.

A part is a module of this package with one result and these names:

- ``jobs(scale)``: lists of jobs by key, for a share of the page's flocks;
- ``results(measured)``: the results of the jobs, a frozen dataclass, which the annotation names;
- ``verdict(results)``: the verdict by a rule on intervals;
- ``figure(results)``: the published result and the one here;
- ``templates/NAME.md``: its section of the page, which gets the module as ``part``, and sets ``title``,
  ``published`` and ``here``, the row of the overview.
"""

from enum import StrEnum
from importlib import import_module
from types import ModuleType

PARTS: tuple[str, ...] = ("warning", "vicsek", "predator_ring", "criticality", "milling", "stable_range")
"""The parts in the order of the page. The last one answers an open question."""


class Verdict(StrEnum):
    """Whether the result here agrees with the published one, by the rule of its part."""

    AGREES = "agrees"
    DIFFERS = "differs"
    CANNOT_BE_JUDGED = "cannot be judged"

    @classmethod
    def of(cls, *conditions: object) -> "Verdict":
        """Return the verdict: a result agrees if all conditions are true."""
        return cls.AGREES if all(conditions) else cls.DIFFERS


def part(name: str) -> ModuleType:
    """Return the module of a part."""
    return import_module(f"{__name__}.{name}")
