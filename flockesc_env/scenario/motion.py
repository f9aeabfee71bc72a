"""Laws of motion: how forces change the velocities of agents (docs/model.md, "Flock")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Inertial:
    """Newton's law with the mass of each agent, as in the paper."""

    kind: ClassVar[str] = "inertial"


@dataclass(frozen=True)
class Vicsek:
    """The Vicsek model: headings follow the force without inertia, at constant speed."""

    kind: ClassVar[str] = "vicsek"


@dataclass(frozen=True)
class Reynolds:
    """The Reynolds model (boids): Newton's law with additional cohesion and separation forces.

    Attributes:
        separation_strength: weight of the force away from close neighbors, dimensionless.
        cohesion_strength: weight of the force toward the center of the neighbors, dimensionless.
        separation_range: distance in m within which a neighbor is close.
    """

    kind: ClassVar[str] = "reynolds"
    separation_strength: float = 1.0
    cohesion_strength: float = 1.0
    separation_range: float = 5.0


Motion = Inertial | Vicsek | Reynolds
