"""Benchmark of flock steps: the paper's flock (300 agents, 240 steps) at six ranges."""

from __future__ import annotations

from functools import partial

from benchmarks import PROJECT
from benchmarks.measure import Candidate, Record, cores, measure
from benchmarks.peers.model import Flocks, Peer
from flockesc_env import FlockScenario, sweep

RANGES = (0.0, 5.0, 10.0, 20.0, 30.0, 100.0)
FLOCKS = 4
"""Number of flocks per call; peers that are faster with more flocks at once get ``flocks_at_once``."""


def run(peers: list[Peer], *, quick: bool) -> list[Record]:
    """Time a step of one flock. This project runs ``sweep`` on one thread, including setup and metrics."""
    scenario = FlockScenario(num_steps=24 if quick else 240)
    steps = scenario.num_steps
    starts = [Flocks.seeded(scenario, range(peer.flocks_at_once or FLOCKS)) for peer in peers]
    records = []
    for rho in RANGES:
        own = partial(sweep, scenario, [rho], range(FLOCKS), num_threads=1)
        candidates = [Candidate(PROJECT, own, FLOCKS * steps)]
        for peer, flocks in zip(peers, starts, strict=True):
            candidates.append(
                Candidate(peer.name, partial(peer.run, flocks, rho, steps), len(flocks.seeds) * steps)
            )
        with cores(1):
            records += measure(
                "kernel", candidates, "flock step", repetitions=3 if quick else 5, case={"rho": rho}
            )
    return records
