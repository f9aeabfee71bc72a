"""Benchmark of flock steps against the number of agents: constant density, dense flocks, two threads.

A size is skipped if a step would take too long, extrapolated from the two previous sizes. For this project
the time is the difference of two sweeps with different numbers of steps, which excludes drawing the initial
state and computing the results. Peers receive the initial state.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial

from benchmarks import PROJECT
from benchmarks.measure import Candidate, Record, cores, measure
from benchmarks.peers.model import Flocks, Peer
from flockesc_env import FlockScenario, sweep

DENSITY = 0.03
"""Agents per m^2, the paper's."""
SIZES = (100, 300, 1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
LARGEST_QUICK = 1_000
RANGE = 10.0
LONGEST_STEP = 2.0
"""In s."""

DENSE_SIZE, DENSE_SIDE, DENSE_RANGES = 100_000, 100.0, (10.0, 30.0)
DENSE_TRIAL = 10_000
"""Number of agents of the trial from which the time of a dense step is extrapolated, with n^2."""
LONGEST_DENSE_STEP = 5.0

_FILL = 0.2
"""Intended duration of a call in s."""
_MOST_STEPS = 240
_FEWEST_OWN_STEPS = 24
"""With fewer steps, this project would re-sort its agents less often per step than in a whole run."""

Steps = Callable[[Flocks, float, int], object]
"""``steps(flocks, interaction_range, count)`` runs ``count`` steps."""


def run(peers: list[Peer], *, quick: bool) -> list[Record]:
    """Time a step at every size, of the dense flock, and of the largest flock on one and two threads."""
    implementations: dict[str, Steps] = {PROJECT: _own, **{peer.name: peer.run for peer in peers}}
    with cores(1):
        records = _constant_density(implementations, quick=quick)
        if not quick:
            for rho in DENSE_RANGES:
                records += _dense(implementations, rho)
    if any(r.contender == PROJECT and r.seconds and r.case == _case(SIZES[-1]) for r in records):
        records += _two_threads()
    return records


def _constant_density(implementations: dict[str, Steps], *, quick: bool) -> list[Record]:
    records: list[Record] = []
    trials: dict[str, list[tuple[int, float]]] = {name: [] for name in implementations}
    for n in SIZES[: SIZES.index(LARGEST_QUICK) + 1] if quick else SIZES:
        flocks = _flocks(n, math.sqrt(n / DENSITY))
        candidates = []
        for name, steps in implementations.items():
            expected_seconds = _extrapolate(trials[name], n)
            if expected_seconds > LONGEST_STEP:
                records.append(_skipped(name, _case(n), expected_seconds))
            else:
                trials[name].append((n, _trial(steps, flocks, RANGE)))
                candidates.append(_candidate(name, steps, flocks, RANGE, trials[name][-1][1]))
        records += measure("size", candidates, "flock step", repetitions=3 if quick else 5, case=_case(n))
    return records


def _dense(implementations: dict[str, Steps], rho: float) -> list[Record]:
    case = {"n": DENSE_SIZE, "side": DENSE_SIDE, "rho": rho}
    trial, flocks = _flocks(DENSE_TRIAL, DENSE_SIDE), _flocks(DENSE_SIZE, DENSE_SIDE)
    records, candidates = [], []
    for name, steps in implementations.items():
        expected_seconds = _trial(steps, trial, rho) * (DENSE_SIZE / DENSE_TRIAL) ** 2
        if expected_seconds > LONGEST_DENSE_STEP:
            records.append(_skipped(name, case, expected_seconds))
        else:
            candidates.append(_candidate(name, steps, flocks, rho, expected_seconds))
    return records + measure("size", candidates, "flock step", repetitions=3, case=case)


def _two_threads() -> list[Record]:
    """Measure the wall-clock time of the largest flock on one and two threads, with one core each."""
    flocks = _flocks(SIZES[-1], math.sqrt(SIZES[-1] / DENSITY))
    candidates = []
    for threads in (1, 2):
        own = _on(threads, partial(_own, num_threads=threads))
        candidate = _candidate(PROJECT, own, flocks, RANGE, math.inf)
        candidates.append(Candidate(**{**vars(candidate), "case": {"threads": threads}}))
    return measure("size", candidates, "flock step", repetitions=5, clock="wall", case=_case(SIZES[-1]))


def _own(flocks: Flocks, rho: float, count: int, *, num_threads: int = 1) -> object:
    scenario = flocks.scenario.replace(num_steps=count)
    return sweep(scenario, [rho], flocks.seeds, num_threads=num_threads)


def _on(count: int, steps: Steps) -> Steps:
    def pinned(flocks: Flocks, rho: float, number: int) -> object:
        with cores(count):
            return steps(flocks, rho, number)

    return pinned


def _flocks(n: int, side: float) -> Flocks:
    return Flocks.seeded(FlockScenario(num_agents=n, initial_side=side), range(1))


def _case(n: int) -> dict[str, float]:
    return {"n": n, "rho": RANGE}


def _trial(steps: Steps, flocks: Flocks, rho: float) -> float:
    """Return the time of one step in s; an earlier call lets the implementation compile."""
    steps(flocks, rho, 1)
    start = time.perf_counter()
    steps(flocks, rho, 1)
    return time.perf_counter() - start


def _extrapolate(trials: list[tuple[int, float]], n: int) -> float:
    """Return the extrapolated time of a step at size n in s; 0 if fewer than two sizes were measured."""
    if len(trials) < 2:
        return 0.0
    (n_1, seconds_1), (n_2, seconds_2) = trials[-2:]
    growth = math.log(seconds_2 / seconds_1) / math.log(n_2 / n_1)
    expected_seconds: float = seconds_2 * (n / n_2) ** min(max(growth, 1.0), 2.0)
    return expected_seconds


def _skipped(name: str, case: dict[str, float], expected_seconds: float) -> Record:
    note = f"skipped: a step would take about {expected_seconds:.0f} s"
    return Record("size", name, case, "flock step", "cpu", [], note)


def _candidate(name: str, steps: Steps, flocks: Flocks, rho: float, step_seconds: float) -> Candidate:
    count = min(max(round(_FILL / step_seconds), 1), _MOST_STEPS)
    if name != PROJECT:
        return Candidate(name, partial(steps, flocks, rho, count), count)
    count = max(count, _FEWEST_OWN_STEPS)
    return Candidate(
        name, partial(steps, flocks, rho, count + 1), count, before=partial(steps, flocks, rho, 1)
    )
