"""The paper's flock under other neighbor rules, beside SciPy: 300 agents, equal initial states."""

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
    """A neighbor rule, what actions set under it, and who else knows it."""

    rule: NeighborRule
    ranges: tuple[float, ...]
    peer: Peer


RULES = {
    "topological": Rule(Topological(), (1.0, 7.0, 20.0), NEAREST),
    "voronoi": Rule(Voronoi(), (10.0, 1000.0), ADJACENT),
}


def run(*, quick: bool) -> list[Record]:
    """Time a step of one flock; this project through ``sweep`` on one thread, set-up and outcome included."""
    records = []
    for name, (rule, ranges, peer) in RULES.items():
        scenario = FlockScenario(num_steps=24 if quick else 240, neighbor_rule=rule)
        peers.check([peer], ranges, rule)
        flocks, units = Flocks.seeded(scenario, range(FLOCKS)), FLOCKS * scenario.num_steps
        for rho in ranges:
            contenders = [
                Candidate(PROJECT, partial(sweep, scenario, [rho], range(FLOCKS), num_threads=1), units),
                Candidate(peer.name, partial(peer.run, flocks, rho, scenario.num_steps), units),
            ]
            with cores(1):
                records += measure(
                    "rules",
                    contenders,
                    "flock step",
                    repetitions=3 if quick else 5,
                    case={"rule": name, "rho": rho},
                )
    return records
