"""Domain randomization: what every episode draws anew, from its seed (docs/model.md, "Randomization")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Uniform:
    """A number of the scenario, drawn uniformly for every episode.

    Attributes:
        field: path of the number in the scenario, as errors name it, for example
            ``predators[0].pure_pursuit.max_turn_rate``.
        low: smallest value.
        high: largest value.
    """

    kind: ClassVar[str] = "uniform"
    field: str
    low: float
    high: float


@dataclass(frozen=True)
class LogUniform:
    """A number of the scenario whose logarithm is drawn uniformly for every episode.

    Attributes:
        field: path of the number in the scenario, as errors name it.
        low: smallest value, above 0.
        high: largest value.
    """

    kind: ClassVar[str] = "log_uniform"
    field: str
    low: float
    high: float


@dataclass(frozen=True)
class Choice:
    """A number of the scenario that is one of several for every episode, each as likely.

    Attributes:
        field: path of the number in the scenario, as errors name it.
        values: the numbers, at least one.
    """

    kind: ClassVar[str] = "choice"
    field: str
    values: tuple[float, ...]


Distribution = Uniform | LogUniform | Choice
