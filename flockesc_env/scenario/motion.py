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


@dataclass(frozen=True)
class PreferredDistance:
    """Newton's law with an additional force that keeps neighbors at a preferred distance.

    Attributes:
        strength: weight of the force, dimensionless.
        distance: distance in m at which a neighbor neither attracts nor repels.
        width: difference in m from ``distance`` at which the force reaches 76 % of its largest norm.
    """

    kind: ClassVar[str] = "preferred_distance"
    strength: float = 1.0
    distance: float = 5.0
    width: float = 2.5


@dataclass(frozen=True)
class Zones:
    """The model of Couzin et al. (2002): zones of repulsion, orientation and attraction, and limited turns.

    Neighbors beyond ``orientation_radius`` attract, so the interaction range is the radius of attraction.

    Attributes:
        repulsion_radius: distance in m within which neighbors repel. One such neighbor outweighs all others.
        orientation_radius: distance in m within which other neighbors align.
        max_turn_rate: largest turn rate in rad/s.
    """

    kind: ClassVar[str] = "zones"
    repulsion_radius: float = 1.0
    orientation_radius: float = 15.0
    max_turn_rate: float = 1.0


@dataclass(frozen=True)
class FirstOrder:
    """The model of Chen and Kolokolnikov (2014): forces are velocities, at most the agent's speed.

    Attributes:
        repulsion: strength in m^2/s of the repulsion between neighbors, which falls as 1 / distance.
        attraction: strength in 1/s of the attraction between neighbors, which grows with the distance.
    """

    kind: ClassVar[str] = "first_order"
    repulsion: float = 1.0
    attraction: float = 1.0


Motion = Inertial | Vicsek | Reynolds | PreferredDistance | Zones | FirstOrder
