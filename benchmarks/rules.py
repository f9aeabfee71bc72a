"""Benchmark of flock steps with topological and Voronoi neighbors, against SciPy."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

from benchmarks import PROJECT, peers
from benchmarks.kernel import FLOCKS
from benchmarks.measure import Candidate, Record, cores, measure
from benchmarks.peers.model import Flocks, Peer
from benchmarks.peers.scipy_rules import ADJACENT, NEAREST
from flockesc_env import FlockScenario, NeighborRule, Topological, Voronoi, sweep


class Rule(NamedTuple):
    """A neighbor rule, the ranges to measure (in its unit), and the peer that implements it."""

    rule: NeighborRule
    ranges: tuple[float, ...]
    peer: Peer


RULES = {
    "topological": Rule(Topological(), (1.0, 7.0, 20.0), NEAREST),
    "voronoi": Rule(Voronoi(), (10.0, 1000.0), ADJACENT),
}


def run(*, quick: bool) -> list[Record]:
    """Time a step of one flock. This project runs ``sweep`` on one thread, including setup and metrics."""
    records = []
    for name, (rule, ranges, peer) in RULES.items():
        scenario = FlockScenario(num_steps=24 if quick else 240, neighbor_rule=rule)
        peers.check([peer], ranges, rule)
        flocks, units = Flocks.seeded(scenario, range(FLOCKS)), FLOCKS * scenario.num_steps
        for rho in ranges:
            candidates = [
                Candidate(PROJECT, partial(sweep, scenario, [rho], range(FLOCKS), num_threads=1), units),
                Candidate(peer.name, partial(peer.run, flocks, rho, scenario.num_steps), units),
            ]
            with cores(1):
                records += measure(
                    "rules",
                    candidates,
                    "flock step",
                    repetitions=3 if quick else 5,
                    case={"rule": name, "rho": rho},
                )
    return records
