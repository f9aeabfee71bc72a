"""Who is whose neighbor: the rules, and what the interaction range means under each of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Metric:
    """All agents within the interaction range are neighbors, boundary and self included."""

    kind: ClassVar[str] = "metric"
    unit: ClassVar[str] = "m"


@dataclass(frozen=True)
class Topological:
    """The k nearest of the agents that are seen are neighbors, and whoever is as near as the last of them.

    The interaction range, and with it an action, sets k: the nearest whole number.
    """

    kind: ClassVar[str] = "topological"
    unit: ClassVar[str] = "neighbors"


@dataclass(frozen=True)
class Voronoi:
    """In the plane, the agents within the interaction range whose Voronoi cells share an edge with its."""

    kind: ClassVar[str] = "voronoi"
    unit: ClassVar[str] = "m"


NeighborRule = Metric | Topological | Voronoi
