"""Benchmark of flock steps against the number of agents, at the paper's density.

A size is skipped if a step would take too long, extrapolated from the two previous sizes. For this project
the time is the difference of two sweeps with different numbers of steps, which excludes drawing the initial
state and computing the results. Peers receive the initial state.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from flockesc_env import FlockScenario, sweep
from speed import PROJECT
from speed.measure import Candidate, Comparison, cores
from speed.peers.model import Flocks, Peer

DENSITY = 0.03
"""Agents per m^2, the paper's."""
SIZES = (100, 300, 1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
LARGEST_QUICK = 1_000
RANGE = 10.0
LONGEST_STEP = 2.0
"""In s."""

_FILL = 0.2
"""Intended duration of a call in s."""
_MOST_STEPS = 240
_FEWEST_OWN_STEPS = 24
"""With fewer steps, this project would re-sort its agents less often per step than in a whole run."""

Steps = Callable[[Flocks, float, int], object]
"""``steps(flocks, interaction_range, count)`` runs ``count`` steps."""


def size(peers: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare steps at every size, and of the largest flock on one and two cores."""
    implementations: dict[str, Steps] = {PROJECT: _own, **{peer.name: peer.run for peer in peers}}
    trials: dict[str, list[tuple[int, float]]] = {name: [] for name in implementations}
    for n in SIZES[: SIZES.index(LARGEST_QUICK) + 1] if quick else SIZES:
        flocks, candidates, skipped = _flocks(n), [], {}
        for name, steps in implementations.items():
            expected_seconds = _extrapolate(trials[name], n)
            if expected_seconds > LONGEST_STEP:
                skipped[name] = f"skipped: a step would take about {expected_seconds:.0f} s"
            else:
                trials[name].append((n, _trial(steps, flocks)))
                candidates.append(_candidate(name, steps, flocks, trials[name][-1][1]))
        yield Comparison(candidates, "flock step", {"n": n, "rho": RANGE}, skipped=skipped)
    if not quick:
        largest = _flocks(SIZES[-1])
        candidates = [
            replace(_candidate(PROJECT, _on(threads), largest, math.inf), case={"threads": threads})
            for threads in (1, 2)
        ]
        yield Comparison(candidates, "flock step", {"n": SIZES[-1], "rho": RANGE}, clock="wall")


def _flocks(n: int) -> Flocks:
    return Flocks.seeded(FlockScenario(num_agents=n, initial_side=math.sqrt(n / DENSITY)), range(1))


def _own(flocks: Flocks, rho: float, count: int, *, num_threads: int = 1) -> object:
    scenario = flocks.scenario.replace(num_steps=count)
    return sweep(scenario, [rho], flocks.seeds, num_threads=num_threads)


def _on(threads: int) -> Steps:
    def pinned(flocks: Flocks, rho: float, count: int) -> object:
        with cores(threads):
            return _own(flocks, rho, count, num_threads=threads)

    return pinned


def _trial(steps: Steps, flocks: Flocks) -> float:
    """Return the time of one step in s; an earlier call lets the implementation compile."""
    with cores(1):
        steps(flocks, RANGE, 1)
        start = time.perf_counter()
        steps(flocks, RANGE, 1)
        return time.perf_counter() - start


def _extrapolate(trials: list[tuple[int, float]], n: int) -> float:
    """Return the extrapolated time of a step at size n in s; 0 if fewer than two sizes were measured."""
    if len(trials) < 2:
        return 0.0
    (n_1, seconds_1), (n_2, seconds_2) = trials[-2:]
    growth = math.log(seconds_2 / seconds_1) / math.log(n_2 / n_1)
    expected_seconds: float = seconds_2 * (n / n_2) ** min(max(growth, 1.0), 2.0)
    return expected_seconds


def _candidate(name: str, steps: Steps, flocks: Flocks, step_seconds: float) -> Candidate:
    count = min(max(round(_FILL / step_seconds), 1), _MOST_STEPS)
    if name != PROJECT:
        return Candidate(name, partial(steps, flocks, RANGE, count), count)
    count = max(count, _FEWEST_OWN_STEPS)
    first = partial(steps, flocks, RANGE, 1)
    return Candidate(name, partial(steps, flocks, RANGE, count + 1), count, before=first)
