"""The paper's flock at six ranges: 300 agents, 240 steps, everybody on the same initial states."""

from __future__ import annotations

from functools import partial

from benchmarks import PROJECT
from benchmarks.measure import Candidate, Record, cores, measure
from benchmarks.peers.model import Flocks, Peer
from flockesc_env import FlockScenario, sweep

RANGES = (0.0, 5.0, 10.0, 20.0, 30.0, 100.0)
FLOCKS = 4
"""Seeds per call; a peer that gains from many flocks at once gets more of them."""


def run(peers: list[Peer], *, quick: bool) -> list[Record]:
    """Time a step of one flock; this project through ``sweep`` on one thread, set-up and outcome included."""
    scenario = FlockScenario(num_steps=24 if quick else 240)
    steps = scenario.num_steps
    starts = [Flocks.seeded(scenario, range(peer.flocks_at_once or FLOCKS)) for peer in peers]
    records = []
    for rho in RANGES:
        own = partial(sweep, scenario, [rho], range(FLOCKS), num_threads=1)
        contenders = [Candidate(PROJECT, own, FLOCKS * steps)]
        for peer, flocks in zip(peers, starts, strict=True):
            contenders.append(
                Candidate(peer.name, partial(peer.run, flocks, rho, steps), len(flocks.seeds) * steps)
            )
        with cores(1):
            records += measure(
                "kernel", contenders, "flock step", repetitions=3 if quick else 5, case={"rho": rho}
            )
    return records
