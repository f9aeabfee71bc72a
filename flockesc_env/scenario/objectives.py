"""The tables of objectives: what an episode maximizes, with the symbol, unit and columns of each one."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Literal

from flockesc_env.common.checks import FloatArray

Objective = Literal["min_mean_distance", "min_min_distance", "fraction_surviving"]


@dataclass(frozen=True, kw_only=True)
class ObjectiveSpec:
    """An objective. A larger one is better."""

    name: str  #: value of the option ``objective``, and column of J in ``info`` and in results
    model: str = "flock"  #: or ``"line"``
    symbol: str  #: symbol of the objective J
    label: str  #: name of the value at one time. J of a flock is its minimum over time
    definition: str  #: definition of J
    unit: str = "m"  #: unit of J; empty for a number without a unit
    series: str  #: column of the value at one time, in ``info`` and ``Trajectory``
    requires: str = "predators"  #: field of the scenario without which J is the same under all ranges

    def with_unit(self, name: str) -> str:
        """Return a name with the unit in parentheses, for axes and headings."""
        return f"{name} ({self.unit})" if self.unit else name

    @property
    def digits(self) -> int:
        """Number of decimals of J in tables."""
        return 2 if self.unit else 3

    def number(self, value: float, sign: str = "") -> str:
        """Return a value of J rounded for a picture; ``sign="+"`` also shows the sign of positive values."""
        return f"{value:{sign}.{1 if self.unit else 3}f}"

    def text(self, value: float, sign: str = "") -> str:
        """Return ``number`` with the unit."""
        return f"{self.number(value, sign)} {self.unit}".rstrip()

    def values(self, results: Any) -> FloatArray:
        """Return J of ``Episodes``, ``LineEpisodes`` or the results of ``sweep``."""
        values: FloatArray = getattr(results, self.name)
        return values

    def is_defined_in(self, scenario: object) -> bool:
        """Return whether the scenario has the field that the objective requires."""
        return getattr(scenario, self.requires) not in (None, ())


def _by_name(*specs: ObjectiveSpec) -> Mapping[str, ObjectiveSpec]:
    return MappingProxyType({spec.name: spec for spec in specs})


FLOCK_OBJECTIVES: Final = _by_name(
    ObjectiveSpec(
        name="min_mean_distance",
        symbol="J_mean",
        label="mean predator distance",
        definition="minimum over time of the mean predator distance (Eq. 12)",
        series="mean_distance",
    ),
    ObjectiveSpec(
        name="min_min_distance",
        symbol="J_min",
        label="minimum predator distance",
        definition="minimum over time of the minimum predator distance (Eq. 13)",
        series="min_distance",
    ),
    ObjectiveSpec(
        name="fraction_surviving",
        symbol="J_survival",
        label="fraction surviving",
        definition="fraction of the agents that are not caught",
        unit="",
        series="fraction_surviving",
        requires="capture_radius",
    ),
)
LINE_OBJECTIVES: Final = _by_name(
    ObjectiveSpec(
        name="escape_distance",
        model="line",
        symbol="d_ss",
        label="escape distance",
        definition="distance between the predator and the nearest agent at the end",
        unit="",
        series="escape_distance",
        requires="predator_position",
    )
)
"""Objectives of each model by name, in the order of the core; the first one is the default."""
OBJECTIVES: Final = (*FLOCK_OBJECTIVES.values(), *LINE_OBJECTIVES.values())
