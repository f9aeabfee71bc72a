"""Parts of scenarios: neighbor rules, laws of motion, initial states and distributions (docs/model.md)."""

import re
from dataclasses import dataclass
from typing import Any, ClassVar

PARTS: dict[str, Any] = {}
"""Classes of parts by kind."""


class Part:
    """Base class of parts. ``kind`` is the name in documents, by default that of the class in snake case."""

    kind: ClassVar[str]

    def __init_subclass__(cls, kind: str = "") -> None:
        cls.kind = kind or re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()
        PARTS[cls.kind] = cls


@dataclass(frozen=True)
class Metric(Part):
    """Neighbors are all agents at distance <= the interaction range, including the agent itself."""


@dataclass(frozen=True)
class Topological(Part):
    """Neighbors are the k nearest visible agents, and all agents tied with the k-th nearest.

    The interaction range is k, rounded to the nearest integer.
    """


@dataclass(frozen=True)
class Voronoi(Part):
    """Neighbors are the agents within the interaction range in adjacent Voronoi cells; in the plane only."""


NeighborRule = Metric | Topological | Voronoi


@dataclass(frozen=True)
class Inertial(Part):
    """Newton's law with the mass of each agent, as in the paper."""


@dataclass(frozen=True)
class Vicsek(Part):
    """The Vicsek model: headings follow the force without inertia, at constant speed."""


@dataclass(frozen=True)
class Reynolds(Part):
    """The Reynolds model (boids): Newton's law with additional cohesion and separation forces.

    Attributes:
        separation_strength: weight of the force away from close neighbors, dimensionless.
        cohesion_strength: weight of the force toward the center of the neighbors, dimensionless.
        separation_range: distance in m within which a neighbor is close.
    """

    separation_strength: float = 1.0
    cohesion_strength: float = 1.0
    separation_range: float = 5.0


@dataclass(frozen=True)
class PreferredDistance(Part):
    """Newton's law with an additional force that keeps neighbors at a preferred distance.

    Attributes:
        strength: weight of the force, dimensionless.
        distance: distance in m at which a neighbor neither attracts nor repels.
        width: difference in m from ``distance`` at which the force reaches 76 % of its largest norm.
    """

    strength: float = 1.0
    distance: float = 5.0
    width: float = 2.5


@dataclass(frozen=True)
class Zones(Part):
    """The model of Couzin et al. (2002): zones of repulsion, orientation and attraction, and limited turns.

    Neighbors beyond ``orientation_radius`` attract, so the interaction range is the radius of attraction.

    Attributes:
        repulsion_radius: distance in m within which neighbors repel. One such neighbor outweighs all others.
        orientation_radius: distance in m within which other neighbors align.
        max_turn_rate: largest turn rate in rad/s.
    """

    repulsion_radius: float = 1.0
    orientation_radius: float = 15.0
    max_turn_rate: float = 1.0


@dataclass(frozen=True)
class FirstOrder(Part):
    """The model of Chen and Kolokolnikov (2014): forces are velocities, at most the agent's speed.

    Attributes:
        repulsion: strength in m^2/s of the repulsion between neighbors, which falls as 1 / distance.
        attraction: strength in 1/s of the attraction between neighbors, which grows with the distance.
    """

    repulsion: float = 1.0
    attraction: float = 1.0


Motion = Inertial | Vicsek | Reynolds | PreferredDistance | Zones | FirstOrder


@dataclass(frozen=True)
class Square(Part):
    """Initial positions uniform in the initial region [0, ``initial_side``]^D, a square or a cube."""


@dataclass(frozen=True)
class Disc(Part):
    """Initial positions uniform in a disc (in space a ball) around the center of the initial region.

    Attributes:
        radius: radius in m, above 0.
    """

    radius: float = 50.0


@dataclass(frozen=True)
class Ring(Part):
    """Initial positions uniform in a ring (in space a spherical shell) around the center of the region.

    Attributes:
        radius: mean of the inner and the outer radius in m, above 0.
        width: difference of the outer and the inner radius in m, from 0 to 2 ``radius``.
    """

    radius: float = 50.0
    width: float = 0.0


@dataclass(frozen=True)
class Segment(Part):
    """Initial positions uniform on a line segment.

    Attributes:
        start: one end in m, 2 or D numbers (a missing z is 0).
        end: the other end in m, 2 or D numbers.
    """

    start: tuple[float, ...] = (0.0, 100.0)
    end: tuple[float, ...] = (100.0, 0.0)


@dataclass(frozen=True)
class Gaussian(Part):
    """Initial positions normally distributed around the center of the initial region.

    Attributes:
        standard_deviation: standard deviation of every coordinate in m, at least 0.
    """

    standard_deviation: float = 25.0


@dataclass(frozen=True)
class Clusters(Part):
    """Initial positions in clusters, with centers uniform in the initial region.

    Attributes:
        num_clusters: number of clusters, at least 1. Agent i belongs to cluster i modulo ``num_clusters``.
        standard_deviation: standard deviation of every coordinate around the center in m, at least 0.
    """

    num_clusters: int = 5
    standard_deviation: float = 5.0


@dataclass(frozen=True)
class RandomHeadings(Part, kind="random"):
    """Initial headings uniform over all directions."""


@dataclass(frozen=True)
class AlignedHeadings(Part, kind="aligned"):
    """Initial headings uniform over the directions within ``max_angle`` of ``direction``.

    Attributes:
        direction: a nonzero vector of 2 or D numbers (a missing z is 0).
        max_angle: largest angle between a heading and ``direction`` in rad, from 0 to pi.
    """

    direction: tuple[float, ...] = (1.0, 0.0)
    max_angle: float = 0.0


@dataclass(frozen=True)
class GivenPositions(Part):
    """Given initial positions.

    Attributes:
        points: one position per agent in m, each of 2 or D numbers (a missing z is 0).
    """

    points: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class GivenHeadings(Part):
    """Given initial headings.

    Attributes:
        directions: one nonzero vector per agent, each of 2 or D numbers (a missing z is 0).
    """

    directions: tuple[tuple[float, ...], ...]


InitialPositions = Square | Disc | Ring | Segment | Gaussian | Clusters | GivenPositions
InitialHeadings = RandomHeadings | AlignedHeadings | GivenHeadings


@dataclass(frozen=True)
class Uniform(Part):
    """A number of the scenario, drawn from the uniform distribution in every episode.

    Attributes:
        field: path of the number in the scenario, as in error messages, for example
            ``predators[0].pure_pursuit.max_turn_rate``.
        low: smallest value.
        high: largest value.
    """

    field: str
    low: float
    high: float


@dataclass(frozen=True)
class LogUniform(Uniform):
    """A number of the scenario, drawn from the log-uniform distribution in every episode.

    Inherits the attributes of ``Uniform``; ``low`` is above 0.
    """


@dataclass(frozen=True)
class Choice(Part):
    """A number of the scenario, drawn from a list of equally likely values in every episode.

    Attributes:
        field: path of the number in the scenario; see ``Uniform``.
        values: the possible values, at least one.
    """

    field: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class RandomApproach(Part):
    """Position and velocity of a predator, drawn together in every episode.

    The predator flies in a uniform direction toward a uniform point of the initial region, at a log-uniform
    speed. The defaults are the paper's distance, and speeds around the paper's within a factor of 2.

    Attributes:
        predator: index of the predator.
        distance: distance in m from the start to the point.
        low: smallest speed in m/s, above 0.
        high: largest speed in m/s.
    """

    predator: int = 0
    distance: float = 80 * 2**0.5
    low: float = 10.0
    high: float = 20.0


Distribution = Uniform | LogUniform | Choice | RandomApproach
