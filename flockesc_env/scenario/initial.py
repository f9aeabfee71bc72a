"""How a flock starts: where its agents are and where they head (docs/model.md, "Flock")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Square:
    """Agents start uniformly in [0, side]^D, a square or in space a cube; side is ``initial_side``."""

    kind: ClassVar[str] = "square"


@dataclass(frozen=True)
class Disc:
    """Agents start uniformly in a disc, in space a ball, around the center of the initial region.

    Attributes:
        radius: in m, above 0.
    """

    kind: ClassVar[str] = "disc"
    radius: float = 50.0


@dataclass(frozen=True)
class Ring:
    """Agents start uniformly in a ring, in space a spherical shell, around the center of the initial region.

    Attributes:
        radius: mean of the inner and the outer radius in m, above 0.
        width: their difference in m, from 0 to 2 ``radius``.
    """

    kind: ClassVar[str] = "ring"
    radius: float = 50.0
    width: float = 0.0


@dataclass(frozen=True)
class Segment:
    """Agents start uniformly along a line segment.

    Attributes:
        start: one end in m, 2 numbers or as many as the scenario's dimension (a missing z is 0).
        end: the other end in m, likewise.
    """

    kind: ClassVar[str] = "segment"
    start: tuple[float, ...] = (0.0, 100.0)
    end: tuple[float, ...] = (100.0, 0.0)


@dataclass(frozen=True)
class Gaussian:
    """Agents start normally distributed around the center of the initial region.

    Attributes:
        standard_deviation: of every coordinate in m, at least 0.
    """

    kind: ClassVar[str] = "gaussian"
    standard_deviation: float = 25.0


@dataclass(frozen=True)
class Clusters:
    """Agents start normally distributed around centers, which are uniform in the initial region.

    Attributes:
        num_clusters: number of centers, at least 1; agent i belongs to center i modulo this number.
        standard_deviation: of every coordinate around its center in m, at least 0.
    """

    kind: ClassVar[str] = "clusters"
    num_clusters: int = 5
    standard_deviation: float = 5.0


@dataclass(frozen=True)
class RandomHeadings:
    """Agents head in directions uniform over all."""

    kind: ClassVar[str] = "random"


@dataclass(frozen=True)
class AlignedHeadings:
    """Agents head in directions uniform over those close to one.

    Attributes:
        direction: of any length but 0, 2 numbers or as many as the scenario's dimension (a missing z is 0).
        max_angle: largest angle between a heading and ``direction`` in rad, from 0 to pi.
    """

    kind: ClassVar[str] = "aligned"
    direction: tuple[float, ...] = (1.0, 0.0)
    max_angle: float = 0.0


@dataclass(frozen=True)
class GivenPositions:
    """Agents start at given points, agent i at the i-th.

    Attributes:
        points: in m, one per agent, each 2 numbers or as many as the scenario's dimension (a missing z is 0).
    """

    kind: ClassVar[str] = "given_positions"
    points: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class GivenHeadings:
    """Agents head in given directions, agent i in the i-th.

    Attributes:
        directions: one vector per agent of any length but 0, each 2 numbers or as many as the scenario's
            dimension (a missing z is 0).
    """

    kind: ClassVar[str] = "given_headings"
    directions: tuple[tuple[float, ...], ...]


InitialPositions = Square | Disc | Ring | Segment | Gaussian | Clusters | GivenPositions
InitialHeadings = RandomHeadings | AlignedHeadings | GivenHeadings
