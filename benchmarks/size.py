"""Cost against the number of agents: at constant density up to a million, in a dense crowd, on two threads.

A size is left out where a step is foreseen to take too long, from how an implementation's last two sizes
grew. This project is timed by the difference of two sweeps with different numbers of steps, so that drawing
the initial state and the outcome at the end do not count; peers are handed their initial state.
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
"""Seconds."""

DENSE_SIZE, DENSE_SIDE, DENSE_RANGES = 100_000, 100.0, (10.0, 30.0)
DENSE_TRIAL = 10_000
"""Agents of the trial that tells how long a dense step will take: its cost grows with n^2."""
LONGEST_DENSE_STEP = 5.0

_FILL = 0.2
"""Seconds that the steps of one call should fill."""
_MOST_STEPS = 240
_FEWEST_OWN_STEPS = 24
"""For this project to arrange its agents about as often per step as in a whole run."""

Steps = Callable[[Flocks, float, int], object]
"""``steps(flocks, interaction_range, count)``."""


def run(peers: list[Peer], *, quick: bool) -> list[Record]:
    """Time a step at every size, in the dense crowd, and of the largest flock on one and two threads."""
    everybody: dict[str, Steps] = {PROJECT: _own, **{peer.name: peer.run for peer in peers}}
    with cores(1):
        records = _constant_density(everybody, quick=quick)
        if not quick:
            for rho in DENSE_RANGES:
                records += _dense(everybody, rho)
    if any(r.contender == PROJECT and r.seconds and r.case == _case(SIZES[-1]) for r in records):
        records += _two_threads()
    return records


def _constant_density(everybody: dict[str, Steps], *, quick: bool) -> list[Record]:
    records: list[Record] = []
    trials: dict[str, list[tuple[int, float]]] = {name: [] for name in everybody}
    for n in SIZES[: SIZES.index(LARGEST_QUICK) + 1] if quick else SIZES:
        flocks = _flocks(n, math.sqrt(n / DENSITY))
        contenders = []
        for name, steps in everybody.items():
            foreseen = _foreseen(trials[name], n)
            if foreseen > LONGEST_STEP:
                records.append(_left_out(name, _case(n), foreseen))
            else:
                trials[name].append((n, _trial(steps, flocks, RANGE)))
                contenders.append(_contender(name, steps, flocks, RANGE, trials[name][-1][1]))
        records += measure("size", contenders, "flock step", repetitions=3 if quick else 5, case=_case(n))
    return records


def _dense(everybody: dict[str, Steps], rho: float) -> list[Record]:
    case = {"n": DENSE_SIZE, "side": DENSE_SIDE, "rho": rho}
    trial, flocks = _flocks(DENSE_TRIAL, DENSE_SIDE), _flocks(DENSE_SIZE, DENSE_SIDE)
    records, contenders = [], []
    for name, steps in everybody.items():
        foreseen = _trial(steps, trial, rho) * (DENSE_SIZE / DENSE_TRIAL) ** 2
        if foreseen > LONGEST_DENSE_STEP:
            records.append(_left_out(name, case, foreseen))
        else:
            contenders.append(_contender(name, steps, flocks, rho, foreseen))
    return records + measure("size", contenders, "flock step", repetitions=3, case=case)


def _two_threads() -> list[Record]:
    """Time the largest flock on as many cores as threads, on the wall."""
    flocks = _flocks(SIZES[-1], math.sqrt(SIZES[-1] / DENSITY))
    contenders = []
    for threads in (1, 2):
        own = _on(threads, partial(_own, num_threads=threads))
        contender = _contender(PROJECT, own, flocks, RANGE, math.inf)
        contenders.append(Candidate(**{**vars(contender), "case": {"threads": threads}}))
    return measure("size", contenders, "flock step", repetitions=5, clock="wall", case=_case(SIZES[-1]))


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
    """Return the seconds of one step, of the second of two calls: the first may compile."""
    steps(flocks, rho, 1)
    start = time.perf_counter()
    steps(flocks, rho, 1)
    return time.perf_counter() - start


def _foreseen(trials: list[tuple[int, float]], n: int) -> float:
    """Return the seconds that a step will take at size n; 0 while too few sizes have been tried."""
    if len(trials) < 2:
        return 0.0
    (n_1, seconds_1), (n_2, seconds_2) = trials[-2:]
    growth = math.log(seconds_2 / seconds_1) / math.log(n_2 / n_1)
    foreseen: float = seconds_2 * (n / n_2) ** min(max(growth, 1.0), 2.0)
    return foreseen


def _left_out(name: str, case: dict[str, float], foreseen: float) -> Record:
    note = f"left out: a step would take about {foreseen:.0f} s"
    return Record("size", name, case, "flock step", "cpu", [], note)


def _contender(name: str, steps: Steps, flocks: Flocks, rho: float, step_seconds: float) -> Candidate:
    count = min(max(round(_FILL / step_seconds), 1), _MOST_STEPS)
    if name != PROJECT:
        return Candidate(name, partial(steps, flocks, rho, count), count)
    count = max(count, _FEWEST_OWN_STEPS)
    return Candidate(
        name, partial(steps, flocks, rho, count + 1), count, before=partial(steps, flocks, rho, 1)
    )
