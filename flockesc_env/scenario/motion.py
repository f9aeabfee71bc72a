"""How agents move: the laws by which forces set velocities (docs/model.md, "Flock")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Inertial:
    """Forces change velocities, by Newton's law, as in the paper."""

    kind: ClassVar[str] = "inertial"


@dataclass(frozen=True)
class Vicsek:
    """Forces are the new headings at once, whatever the masses: the Vicsek model, at constant speed."""

    kind: ClassVar[str] = "vicsek"


@dataclass(frozen=True)
class Reynolds:
    """Forces change velocities, and neighbors keep together and apart: boids.

    Attributes:
        separation_strength: weight of the force away from close neighbors; has no unit.
        cohesion_strength: weight of the force toward the center of the neighbors; has no unit.
        separation_range: distance in m up to which a neighbor is close.
    """

    kind: ClassVar[str] = "reynolds"
    separation_strength: float = 1.0
    cohesion_strength: float = 1.0
    separation_range: float = 5.0


Motion = Inertial | Vicsek | Reynolds
