"""Benchmarks of flock steps and of the paper's grid search. This project runs ``sweep``."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from flockesc_env import FlockScenario, NeighborRule, Topological, Voronoi, sweep
from speed import PROJECT, peers
from speed.measure import Candidate, Comparison, cores
from speed.peers.model import Floats, Flocks, Peer
from speed.peers.numpy_flocks import ADJACENT, NEAREST

RANGES = (0.0, 5.0, 10.0, 20.0, 30.0, 100.0)
FLOCKS = 4
"""Number of flocks per call; peers that are faster with more flocks at once get ``flocks_at_once``."""

GRID = np.linspace(1.0, 100.0, 100)
GRID_SEEDS = range(40)


class Rule(NamedTuple):
    """A neighbor rule, the ranges to measure (in its unit), and the peer that implements it."""

    rule: NeighborRule
    ranges: tuple[float, ...]
    peer: Peer


RULES = {
    "topological": Rule(Topological(), (1.0, 7.0, 20.0), NEAREST),
    "voronoi": Rule(Voronoi(), (10.0, 1000.0), ADJACENT),
}


def kernel(others: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare steps of the paper's flock (300 agents, 240 steps) at six ranges."""
    yield from _steps(_paper(quick=quick), RANGES, others)


def rules(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare steps with topological and Voronoi neighbors."""
    for name, (rule, ranges, peer) in RULES.items():
        peers.check([peer], ranges, rule)
        yield from _steps(_paper(quick=quick).replace(neighbor_rule=rule), ranges, [peer], {"rule": name})


def grid(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare the whole grid search on one core and on two."""
    ranges = GRID[::20] if quick else GRID
    candidates = [
        Candidate(PROJECT, partial(_search, ranges, threads), 1, case={"threads": threads})
        for threads in (1, 2)
    ]
    case = {"ranges": len(ranges), "seeds": len(GRID_SEEDS)}
    yield Comparison(candidates, "grid search", case, clock="wall", repetitions=3)


def _paper(*, quick: bool) -> FlockScenario:
    return FlockScenario(num_steps=24 if quick else 240)


def _steps(
    scenario: FlockScenario, ranges: tuple[float, ...], others: list[Peer], case: dict[str, Any] | None = None
) -> Iterator[Comparison]:
    steps = scenario.num_steps
    starts = [Flocks.seeded(scenario, range(peer.flocks_at_once or FLOCKS)) for peer in others]
    for rho in ranges:
        own = partial(sweep, scenario, [rho], range(FLOCKS), num_threads=1)
        candidates = [Candidate(PROJECT, own, FLOCKS * steps)]
        for peer, flocks in zip(others, starts, strict=True):
            run = partial(peer.run, flocks, rho, steps)
            candidates.append(Candidate(peer.name, run, len(flocks.seeds) * steps))
        yield Comparison(candidates, "flock step", {**(case or {}), "rho": rho})


def _search(ranges: Floats, threads: int) -> None:
    with cores(threads):
        sweep(FlockScenario(), ranges, GRID_SEEDS, num_threads=threads)
