"""Benchmark of line steps: the paper's line (100 agents) at four ranges, until the steady state."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from flockesc_env import LineScenario, simulate_line, sweep
from speed.measure import PROJECT, Candidate, Comparison
from speed.peers import TOLERANCE, DisagreementError, Floats, Peer

RANGES = (0.05, 0.1, 0.2, 0.5)
LINES = 200

Run = Callable[[Floats, LineScenario, float, int], Floats]
"""``run(states, scenario, interaction_range, steps)`` returns the states after ``steps`` steps."""


def line(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare steps of one line. For this project: a whole sweep minus a sweep of one step."""
    scenario = LineScenario()
    seeds = range(20 if quick else LINES)
    for rho in RANGES:
        lines = [simulate_line(scenario, rho, seed=seed) for seed in seeds]
        starts, steps = [line.states[0] for line in lines], [line.steps for line in lines]
        whole = partial(sweep, scenario, [rho], seeds, num_threads=1)
        first = partial(sweep, scenario.replace(max_steps=1), [rho], seeds, num_threads=1)
        candidates = [Candidate(PROJECT, whole, sum(steps) - len(lines), before=first)]
        for name, peer in PEERS.items():
            check(name, peer, rho)
            candidates.append(Candidate(name, partial(_all, peer, starts, scenario, rho, steps), sum(steps)))
        yield Comparison(candidates, "line step", {"rho": rho})


def check(name: str, peer: Run, rho: float) -> None:
    """Compare a peer with this project on every step of a line until its steady state.

    Raises:
        DisagreementError: if they differ by more than ``TOLERANCE``.
    """
    scenario = LineScenario()
    states = simulate_line(scenario, rho, seed=0).states
    reached = [peer(before, scenario, rho, 1) for before in states[:-1]]
    difference = np.abs(np.array(reached) - states[1:]).max()
    if not difference <= TOLERANCE:
        raise DisagreementError(f"{name} differs by {difference:.3g} on the line at rho = {rho}")


def _all(peer: Run, starts: list[Floats], scenario: LineScenario, rho: float, steps: list[int]) -> None:
    for states, count in zip(starts, steps, strict=True):
        peer(states, scenario, rho, count)


def _numpy(states: Floats, scenario: LineScenario, interaction_range: float, steps: int) -> Floats:
    predator = np.float64(scenario.predator_position or 0.0)
    for _ in range(steps):
        near = np.abs(states[:, None] - states) <= interaction_range
        offset = states - predator
        push = scenario.repulsion_strength * (scenario.predator_range * np.sign(offset) - offset)
        push[(np.abs(offset) >= scenario.predator_range) | (offset == 0.0)] = 0.0
        states = near @ states / near.sum(axis=1) + push
    return states


PEERS: dict[str, Run] = {"NumPy, all pairs": _numpy}
