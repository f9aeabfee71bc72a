"""Domain randomization: distributions of scenario fields per episode (docs/model.md, "Randomization")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Uniform:
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
class LogUniform:
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
class Choice:
    """A number of the scenario, drawn from a list of equally likely values in every episode.

    Attributes:
        field: path of the number in the scenario; see ``Uniform``.
        values: the possible values, at least one.
    """

    kind: ClassVar[str] = "choice"
    field: str
    values: tuple[float, ...]


Distribution = Uniform | LogUniform | Choice
