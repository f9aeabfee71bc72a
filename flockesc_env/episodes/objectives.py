"""The table of objectives: what an episode maximizes, with the symbol, unit and columns of each objective."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import FloatArray
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

Objective = Literal["min_mean_distance", "min_min_distance", "fraction_surviving"]


@dataclass(frozen=True, eq=False, repr=False)
class FlockOutcomes:
    """Base class of results of runs of flocks: their seeds and every objective.

    Attributes:
        seeds: the seeds, shape (seeds,).
        min_mean_distance: J_mean, the minimum over time of the mean predator distance, in m (Eq. 12).
        min_min_distance: J_min, the minimum over time of the minimum predator distance, in m (Eq. 13).
        fraction_surviving: share of agents that are not caught at the end.
    """

    seeds: NDArray[np.uint64]
    min_mean_distance: FloatArray
    min_min_distance: FloatArray
    fraction_surviving: FloatArray


@dataclass(frozen=True)
class ObjectiveSpec:
    """An objective. A larger one is better.

    Attributes:
        name: value of the option ``objective``, and column of J so far, in ``info``, ``Episodes`` and
            ``SweepResult``.
        model: ``"flock"`` or ``"line"``.
        symbol: symbol of the objective J.
        label: name of the value at one time. J of a flock is its minimum over time.
        definition: definition of J.
        unit: unit of J; empty for a number without a unit.
        series: column of the value at one time, in ``info`` and ``Trajectory``.
        requires: field of the scenario without which J is the same under all ranges.
    """

    name: str
    model: str
    symbol: str
    label: str
    definition: str
    unit: str
    series: str
    requires: str

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

    def is_defined_in(self, scenario: FlockScenario | LineScenario) -> bool:
        """Return whether the scenario has the field that the objective requires."""
        return getattr(scenario, self.requires) not in (None, ())


OBJECTIVES: Final = (
    ObjectiveSpec(
        name="min_mean_distance",
        model="flock",
        symbol="J_mean",
        label="mean predator distance",
        definition="minimum over time of the mean predator distance (Eq. 12)",
        unit="m",
        series="mean_distance",
        requires="predators",
    ),
    ObjectiveSpec(
        name="min_min_distance",
        model="flock",
        symbol="J_min",
        label="minimum predator distance",
        definition="minimum over time of the minimum predator distance (Eq. 13)",
        unit="m",
        series="min_distance",
        requires="predators",
    ),
    ObjectiveSpec(
        name="fraction_surviving",
        model="flock",
        symbol="J_survival",
        label="fraction surviving",
        definition="fraction of the agents that are not caught",
        unit="",
        series="fraction_surviving",
        requires="capture_radius",
    ),
    ObjectiveSpec(
        name="escape_distance",
        model="line",
        symbol="d_ss",
        label="escape distance",
        definition="distance between the predator and the nearest agent at the end",
        unit="",
        series="escape_distance",
        requires="predator_position",
    ),
)
FLOCK_OBJECTIVES: Final = {spec.name: spec for spec in OBJECTIVES if spec.model == "flock"}
LINE_OBJECTIVES: Final = {spec.name: spec for spec in OBJECTIVES if spec.model == "line"}
"""Objectives of each model by name; the first one is the default."""
