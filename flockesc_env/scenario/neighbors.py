"""Neighbor rules: metric, topological and Voronoi neighbors, and what the interaction range means in each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Metric:
    """Neighbors are all agents at distance <= the interaction range, including the agent itself."""

    kind: ClassVar[str] = "metric"
    unit: ClassVar[str] = "m"


@dataclass(frozen=True)
class Topological:
    """Neighbors are the k nearest visible agents, and all agents tied with the k-th nearest.

    The interaction range is k, rounded to the nearest integer.
    """

    kind: ClassVar[str] = "topological"
    unit: ClassVar[str] = "neighbors"


@dataclass(frozen=True)
class Voronoi:
    """Neighbors are the agents within the interaction range in adjacent Voronoi cells; in the plane only."""

    kind: ClassVar[str] = "voronoi"
    unit: ClassVar[str] = "m"


NeighborRule = Metric | Topological | Voronoi
