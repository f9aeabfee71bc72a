"""Distributions of initial positions and headings (docs/model.md, "Flock")."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Square:
    """Initial positions uniform in the initial region [0, ``initial_side``]^D, a square or a cube."""

    kind: ClassVar[str] = "square"


@dataclass(frozen=True)
class Disc:
    """Initial positions uniform in a disc (in space a ball) around the center of the initial region.

    Attributes:
        radius: radius in m, above 0.
    """

    kind: ClassVar[str] = "disc"
    radius: float = 50.0


@dataclass(frozen=True)
class Ring:
    """Initial positions uniform in a ring (in space a spherical shell) around the center of the region.

    Attributes:
        radius: mean of the inner and the outer radius in m, above 0.
        width: difference of the outer and the inner radius in m, from 0 to 2 ``radius``.
    """

    kind: ClassVar[str] = "ring"
    radius: float = 50.0
    width: float = 0.0


@dataclass(frozen=True)
class Segment:
    """Initial positions uniform on a line segment.

    Attributes:
        start: one end in m, 2 or D numbers (a missing z is 0).
        end: the other end in m, 2 or D numbers.
    """

    kind: ClassVar[str] = "segment"
    start: tuple[float, ...] = (0.0, 100.0)
    end: tuple[float, ...] = (100.0, 0.0)


@dataclass(frozen=True)
class Gaussian:
    """Initial positions normally distributed around the center of the initial region.

    Attributes:
        standard_deviation: standard deviation of every coordinate in m, at least 0.
    """

    kind: ClassVar[str] = "gaussian"
    standard_deviation: float = 25.0


@dataclass(frozen=True)
class Clusters:
    """Initial positions in clusters, with centers uniform in the initial region.

    Attributes:
        num_clusters: number of clusters, at least 1. Agent i belongs to cluster i modulo ``num_clusters``.
        standard_deviation: standard deviation of every coordinate around the center in m, at least 0.
    """

    kind: ClassVar[str] = "clusters"
    num_clusters: int = 5
    standard_deviation: float = 5.0


@dataclass(frozen=True)
class RandomHeadings:
    """Initial headings uniform over all directions."""

    kind: ClassVar[str] = "random"


@dataclass(frozen=True)
class AlignedHeadings:
    """Initial headings uniform over the directions within ``max_angle`` of ``direction``.

    Attributes:
        direction: a nonzero vector of 2 or D numbers (a missing z is 0).
        max_angle: largest angle between a heading and ``direction`` in rad, from 0 to pi.
    """

    kind: ClassVar[str] = "aligned"
    direction: tuple[float, ...] = (1.0, 0.0)
    max_angle: float = 0.0


@dataclass(frozen=True)
class GivenPositions:
    """Given initial positions.

    Attributes:
        points: one position per agent in m, each of 2 or D numbers (a missing z is 0).
    """

    kind: ClassVar[str] = "given_positions"
    points: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class GivenHeadings:
    """Given initial headings.

    Attributes:
        directions: one nonzero vector per agent, each of 2 or D numbers (a missing z is 0).
    """

    kind: ClassVar[str] = "given_headings"
    directions: tuple[tuple[float, ...], ...]


InitialPositions = Square | Disc | Ring | Segment | Gaussian | Clusters | GivenPositions
InitialHeadings = RandomHeadings | AlignedHeadings | GivenHeadings
