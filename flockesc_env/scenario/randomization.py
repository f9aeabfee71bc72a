"""Domain randomization: distributions of scenario fields per episode (docs/model.md, "Randomization")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


class _OneNumber:
    """A distribution of one number of the scenario."""

    field: str

    @property
    def fields(self) -> tuple[str, ...]:
        """Paths of the drawn numbers."""
        return (self.field,)


@dataclass(frozen=True)
class Uniform(_OneNumber):
    """A number of the scenario, drawn from the uniform distribution in every episode.

    Attributes:
        field: path of the number in the scenario, as in error messages, for example
            ``predators[0].pure_pursuit.max_turn_rate``.
        low: smallest value.
        high: largest value.
    """

    kind: ClassVar[str] = "uniform"
    field: str
    low: float
    high: float


@dataclass(frozen=True)
class LogUniform(_OneNumber):
    """A number of the scenario, drawn from the log-uniform distribution in every episode.

    Attributes:
        field: path of the number in the scenario; see ``Uniform``.
        low: smallest value, above 0.
        high: largest value.
    """

    kind: ClassVar[str] = "log_uniform"
    field: str
    low: float
    high: float


@dataclass(frozen=True)
class Choice(_OneNumber):
    """A number of the scenario, drawn from a list of equally likely values in every episode.

    Attributes:
        field: path of the number in the scenario; see ``Uniform``.
        values: the possible values, at least one.
    """

    kind: ClassVar[str] = "choice"
    field: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class RandomApproach:
    """Position and velocity of a predator, drawn together in every episode.

    The predator flies in a uniform direction toward a uniform point of the initial region, at a log-uniform
    speed. The defaults are the paper's distance, and speeds around the paper's within a factor of 2.

    Attributes:
        predator: index of the predator.
        distance: distance in m from the start to the point.
        low: smallest speed in m/s, above 0.
        high: largest speed in m/s.
    """

    kind: ClassVar[str] = "random_approach"
    predator: int = 0
    distance: float = 80 * 2**0.5
    low: float = 10.0
    high: float = 20.0

    @property
    def fields(self) -> tuple[str, ...]:
        """Paths of the drawn numbers."""
        vectors = (f"predators[{self.predator}].{name}" for name in ("position", "velocity"))
        return tuple(f"{vector}[{axis}]" for vector in vectors for axis in range(3))


Distribution = Uniform | LogUniform | Choice | RandomApproach
