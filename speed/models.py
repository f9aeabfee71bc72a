"""Benchmarks of model steps, of the paper's grid search, and of the machine. This project runs ``sweep``."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from flockesc_env import FlockScenario, LineScenario, simulate, simulate_line, sweep
from flockesc_env.scenario import NeighborRule, Topological, Voronoi
from speed import peers
from speed.measure import PROJECT, Call, Candidate, Case, Comparison, cores, spent
from speed.peers import TOLERANCE, DisagreementError, Floats, Flocks, Peer
from speed.peers.numpy_flocks import ADJACENT, NEAREST

RANGES = (0.0, 5.0, 10.0, 20.0, 30.0, 100.0)
FLOCKS = 4  # per call; peers that are faster with more flocks at once have ``flocks_at_once``
GRID = np.linspace(1.0, 100.0, 100)
GRID_SEEDS = range(40)

DENSITY = 0.03  # agents per m^2, the paper's
SIZES = (100, 300, 1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
SIZE_RANGE = 10.0
_NUM_QUICK_SIZES = 3
_FILL = 0.2  # intended duration of a call in s
_MOST_STEPS = 240
_FEWEST_OWN_STEPS = 24
"""With fewer steps, this project would re-sort its agents less often per step than in a whole run."""

BANDWIDTH, ARITHMETIC = "bandwidth", "arithmetic"
BYTES = 64  # bytes that a step must move per agent: position and velocity in f64, read and written, D = 2
_PER_NEIGHBOR = 8  # operations: 2 differences, 2 squares, a sum, a comparison, 2 sums of velocities
_PER_AGENT = 35  # operations: two norms, three divisions, two forces, the motion, the distance

RULES: dict[str, tuple[NeighborRule, tuple[float, ...], Peer]] = {
    "topological": (Topological(), (1.0, 7.0, 20.0), NEAREST),
    "voronoi": (Voronoi(), (10.0, 1000.0), ADJACENT),
}
"""Neighbor rules, the ranges to measure (in the rule's unit), and the peer that implements the rule."""

LINE_RANGES = (0.05, 0.1, 0.2, 0.5)
LINES = 200
LinePeer = Callable[[Floats, LineScenario, float, int], Floats]
"""``peer(states, scenario, interaction_range, steps)`` returns the states after ``steps`` steps."""


def kernel(others: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare steps of the paper's flock (300 agents, 240 steps) at six ranges."""
    yield from _steps(_paper(quick=quick), RANGES, others, {})


def rules(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare steps with topological and Voronoi neighbors."""
    for name, (rule, ranges, peer) in RULES.items():
        peers.check([peer], ranges, rule)
        yield from _steps(_paper(quick=quick).replace(neighbor_rule=rule), ranges, [peer], {"rule": name})


def _paper(*, quick: bool) -> FlockScenario:
    return FlockScenario(num_steps=24 if quick else 240)


def _steps(
    scenario: FlockScenario, ranges: Iterable[float], others: list[Peer], case: Case
) -> Iterator[Comparison]:
    steps = scenario.num_steps
    starts = [Flocks.seeded(scenario, range(peer.flocks_at_once or FLOCKS)) for peer in others]
    for rho in ranges:
        own = partial(sweep, scenario, [rho], range(FLOCKS), num_threads=1)
        candidates = [Candidate(PROJECT, own, FLOCKS * steps)]
        for peer, flocks in zip(others, starts, strict=True):
            run = partial(peer.run, flocks, rho, steps)
            candidates.append(Candidate(peer.name, run, len(flocks.seeds) * steps))
        yield Comparison(candidates, "flock step", {**case, "rho": rho})


def grid(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare the whole grid search on one core and on two."""
    ranges = GRID[::20] if quick else GRID
    candidates = [
        Candidate(PROJECT, partial(_sweep, FlockScenario(), ranges, GRID_SEEDS, n), 1, case={"threads": n})
        for n in (1, 2)
    ]
    case = {"ranges": len(ranges), "seeds": len(GRID_SEEDS)}
    yield Comparison(candidates, "grid search", case, clock="wall")


def size(others: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare steps at every size up to the peer's largest, and of the largest flock on one and two cores."""
    for n in SIZES[:_NUM_QUICK_SIZES] if quick else SIZES:
        flocks = Flocks.seeded(FlockScenario(num_agents=n, initial_side=math.sqrt(n / DENSITY)), range(1))
        candidates = [_own(flocks, 1)]
        for peer in others:
            if n <= peer.largest:
                count = _num_steps(partial(peer.run, flocks, SIZE_RANGE, 1))
                run = partial(peer.run, flocks, SIZE_RANGE, count)
                candidates.append(Candidate(peer.name, run, count))
        yield Comparison(candidates, "flock step", {"n": n, "rho": SIZE_RANGE})
    if not quick:
        candidates = [replace(_own(flocks, threads), case={"threads": threads}) for threads in (1, 2)]
        yield Comparison(candidates, "flock step", {"n": n, "rho": SIZE_RANGE}, clock="wall")


def _own(flocks: Flocks, threads: int) -> Candidate:
    """Return the difference of two sweeps, as peers receive the initial state and return no results."""

    def run(steps: int) -> None:
        _sweep(flocks.scenario.replace(num_steps=steps), [SIZE_RANGE], flocks.seeds, threads)

    count = max(_num_steps(partial(run, 1)), _FEWEST_OWN_STEPS)
    return Candidate(PROJECT, partial(run, count + 1), count, before=partial(run, 1))


def _num_steps(run: Call) -> int:
    """Return the number of steps of a call from the time of one, after a call in which peers compile."""
    with cores(1):
        run()
        return min(max(round(_FILL / spent(run, 1, "wall")), 1), _MOST_STEPS)


def _sweep(scenario: FlockScenario, ranges: Floats | list[float], seeds: Iterable[int], threads: int) -> None:
    with cores(threads):
        sweep(scenario, ranges, seeds, num_threads=threads)


def floor(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Measure the least time of a step: the memory traffic of large flocks, the arithmetic of the paper's."""
    numbers = np.ones(2**20 if quick else 2**24)
    copied = partial(np.copyto, np.empty_like(numbers), numbers)
    yield Comparison([Candidate(BANDWIDTH, copied, 2 * numbers.nbytes)], "byte")
    matrix = np.ones((256, 256) if quick else (1024, 1024))
    multiplied = Candidate(ARITHMETIC, partial(np.matmul, matrix, matrix), 2 * len(matrix) ** 3)
    scenario = _paper(quick=quick)
    for rho in RANGES:
        pairs = [
            cKDTree(positions).count_neighbors(cKDTree(positions), rho)
            for seed in range(FLOCKS)
            for positions in simulate(scenario, rho, seed=seed).positions[:: scenario.num_steps // 12]
        ]
        operations = float(_PER_NEIGHBOR * np.mean(pairs) + _PER_AGENT * scenario.num_agents)
        yield Comparison([multiplied], "operation", {"rho": rho, "operations": operations})


def line(_: list[Peer], *, quick: bool) -> Iterator[Comparison]:
    """Compare steps of the paper's line (100 agents) until the steady state, at four ranges.

    For this project: a whole sweep minus a sweep of one step.
    """
    scenario = LineScenario()
    seeds = range(20 if quick else LINES)
    for rho in LINE_RANGES:
        lines = [simulate_line(scenario, rho, seed=seed) for seed in seeds]
        starts, steps = [line.states[0] for line in lines], [line.steps for line in lines]
        whole = partial(sweep, scenario, [rho], seeds, num_threads=1)
        first = partial(sweep, scenario.replace(max_steps=1), [rho], seeds, num_threads=1)
        check_line(numpy_line, rho)
        own = Candidate(PROJECT, whole, sum(steps) - len(lines), before=first)
        peer = Candidate("NumPy, all pairs", partial(_numpy_lines, starts, scenario, rho, steps), sum(steps))
        yield Comparison([own, peer], "line step", {"rho": rho})


def check_line(peer: LinePeer, rho: float) -> None:
    """Compare a peer with this project on every step of a line until its steady state.

    Raises:
        DisagreementError: if they differ by more than ``TOLERANCE``.
    """
    scenario = LineScenario()
    states = simulate_line(scenario, rho, seed=0).states
    reached = [peer(before, scenario, rho, 1) for before in states[:-1]]
    difference = np.abs(np.array(reached) - states[1:]).max()
    if not difference <= TOLERANCE:
        raise DisagreementError(f"a peer differs by {difference:.3g} on the line at rho = {rho}")


def _numpy_lines(starts: list[Floats], scenario: LineScenario, rho: float, steps: list[int]) -> None:
    for states, count in zip(starts, steps, strict=True):
        numpy_line(states, scenario, rho, count)


def numpy_line(states: Floats, scenario: LineScenario, interaction_range: float, steps: int) -> Floats:
    """The peer of the line: all pairs in NumPy."""
    predator = np.float64(scenario.predator_position or 0.0)
    for _ in range(steps):
        near = np.abs(states[:, None] - states) <= interaction_range
        offset = states - predator
        push = scenario.repulsion_strength * (scenario.predator_range * np.sign(offset) - offset)
        push[(np.abs(offset) >= scenario.predator_range) | (offset == 0.0)] = 0.0
        states = near @ states / near.sum(axis=1) + push
    return states
