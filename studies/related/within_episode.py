"""The bandit within an episode, tuned on tuning flocks, against the best fixed range on held-out flocks."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations, product
from typing import Final

import numpy as np
import polars as pl

from flockesc_env import FlockScenario, rollout
from flockesc_env.benchmark.seeds import HELD_OUT, TUNING, first_seeds
from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays, Job
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
from studies.learned.held_out import FLOCK_GRID
from studies.learned.results import BEST_FIXED, Study
from studies.measurements import Runner
from studies.related.bandit import RangeBandit, across_episodes
from studies.robustness.findings import OBJECTIVES
from studies.tables import rows

BANDIT: Final = "bandit over fixed ranges"
"""Name of the policy in tables."""

ENTRIES: Final[dict[str, tuple[str, ...]]] = {
    "J_mean": ("mean_distance", "heading_away"),
    "J_min": ("min_distance", "heading_away"),
}
"""Observation entries whose change is tried as the reward of a pull."""

ARMS: Final = (
    (8.0, 12.0, 16.0),
    (0.0, 12.0, 150.0),
    (0.0, 6.0, 10.0, 12.0, 16.0, 20.0, 40.0, 150.0),
)
"""Ranges in m that are tried."""

FIRST_FLOCKS, FINALISTS, FINAL_FLOCKS = 40, 5, 400
"""All candidates play a few tuning flocks, and the best of them more, so that luck does not choose."""

ACROSS_EXPLORATION: Final = 10.0
"""c in m of the bandit across episodes: about the standard deviation of J_mean over flocks."""

IN_TURNS: Final = 1e30
"""An exploration constant so large that rewards do not count: the arms are pulled in turns."""

MOST_PERMUTED: Final = 4
"""Largest number of arms for which the control tries all orders."""

_FLOCK = 5e-3
"""Estimated seconds of an episode."""


@dataclass(frozen=True)
class BanditNumbers:
    """The numbers of a bandit that are tuned; see ``RangeBandit``."""

    ranges: tuple[float, ...]
    exploration: float
    window: int | None
    entry: str
    steps_per_action: int

    def policy(self) -> RangeBandit:
        """Return the policy."""
        return RangeBandit(self.ranges, self.exploration, self.window, self.entry)


@dataclass(frozen=True)
class Order:
    """The control for one order of the arms: paired differences in m.

    ``turns`` and ``bandit`` are the arms pulled in turns and the bandit minus the best fixed range;
    ``over_turns`` is the bandit minus the arms pulled in turns.
    """

    ranges: tuple[float, ...]
    turns: Estimate
    bandit: Estimate
    over_turns: Estimate


@dataclass(frozen=True)
class WithinEpisode:
    """Results of the bandit within an episode for one objective, in m.

    ``numbers`` and ``fixed_range`` are the best on tuning flocks; the rest is measured on held-out flocks.
    ``difference`` and ``learned``, of the best learner of the study, are to the best fixed range. ``orders``
    has the bandit's own order first; ``mean_order`` is the mean over the orders on every flock.
    """

    numbers: BanditNumbers
    fixed_range: float
    value: Estimate
    fixed: Estimate
    difference: Estimate
    improvement: Estimate
    mean_order: Order
    orders: tuple[Order, ...]
    learner: str
    learned: Estimate
    candidates: int


@dataclass(frozen=True)
class AcrossEpisodes:
    """Results of the bandit across episodes for J_mean: one pull per episode, runs on shuffled tuning flocks.

    ``most_pulled`` is the share of the runs whose most pulled arm is each range. ``fixed_range`` is the best
    one on these flocks, and ``best`` its mean objective; ``mean`` is that of the runs.
    """

    episodes: int
    runs: int
    most_pulled: dict[str, float]
    fixed_range: float
    mean: Estimate
    best: float


def candidates(symbol: str) -> list[BanditNumbers]:
    """Return all combinations of numbers that are tried for an objective."""
    explorations = (0.0, 0.003, 0.03)
    choices = product(ARMS, explorations, (None, 20), ENTRIES[symbol], (1, 4, 8))
    return [BanditNumbers(*numbers) for numbers in choices]


def play(numbers: BanditNumbers, flocks: range) -> Arrays:
    """Return both objectives of the bandit on some flocks."""
    episodes = rollout(
        FlockScenario(),
        numbers.policy(),
        flocks,
        num_threads=1,
        steps_per_action=numbers.steps_per_action,
        max_range=max(numbers.ranges),
    )
    return {column: getattr(episodes, column) for column in OBJECTIVES.values()}


def orders(ranges: tuple[float, ...]) -> list[tuple[float, ...]]:
    """Return the orders of the arms that the control tries, the given one first.

    These are all orders of up to ``MOST_PERMUTED`` arms, and the rotations of more arms in both directions.
    """
    if len(ranges) <= MOST_PERMUTED:
        return list(permutations(ranges))
    return [arms[at:] + arms[:at] for arms in (ranges, ranges[::-1]) for at in range(len(ranges))]


def control(ranges: tuple[float, ...], bandit: FloatArray, turns: FloatArray, fixed: FloatArray) -> Order:
    """Return the control for one order of the arms, from objectives in m, shape (flocks,)."""
    return Order(ranges, stats.mean(turns - fixed), stats.mean(bandit - fixed), stats.mean(bandit - turns))


def within_episode(symbol: str, shared: Study, runner: Runner) -> tuple[WithinEpisode, pl.DataFrame]:
    """Tune the bandit, and measure it on the held-out flocks of a study of one range for the flock.

    Returns:
        The results, and a row per flock in the columns of the study's table of episodes.
    """
    column, tried = OBJECTIVES[symbol], candidates(symbol)
    held_out = first_seeds(HELD_OUT, shared.held_out_flocks)

    def played(some: Sequence[BanditNumbers], flocks: range) -> FloatArray:
        call = f"{__name__}:play"
        jobs = {at: Job(call, (one, flocks), len(flocks) * _FLOCK) for at, one in enumerate(some)}
        return np.stack([found[column] for found in runner.each(jobs, "Bandits").values()])

    first = played(tried, first_seeds(TUNING, FIRST_FLOCKS)).mean(axis=1)
    finalists = [tried[place] for place in np.argsort(-first, kind="stable")[:FINALISTS]]
    final = played(finalists, first_seeds(TUNING, FINAL_FLOCKS))
    numbers = finalists[int(final.mean(axis=1).argmax())]
    arms = orders(numbers.ranges)
    ordered = [dataclasses.replace(numbers, ranges=ranges) for ranges in arms]
    bandits = played(ordered, held_out)
    turns = played([dataclasses.replace(one, exploration=IN_TURNS) for one in ordered], held_out)
    values = bandits[0]
    (fixed,) = shared.values(BEST_FIXED)
    results = WithinEpisode(
        numbers=numbers,
        fixed_range=shared.best_fixed_range,
        value=stats.mean(values),
        fixed=stats.mean(fixed),
        difference=stats.mean(values - fixed),
        improvement=stats.improvement(values, fixed),
        mean_order=control(numbers.ranges, bandits.mean(axis=0), turns.mean(axis=0), fixed),
        orders=tuple(control(*order, fixed) for order in zip(arms, bandits, turns, strict=True)),
        learner=shared.best_learner,
        learned=stats.mean(shared.values(shared.best_learner).mean(axis=0) - fixed),
        candidates=len(tried),
    )
    return results, rows(held_out, values, policy=BANDIT, training_seed=None)


def across(num_flocks: int, runs: int, runner: Runner) -> AcrossEpisodes:
    """Run UCB1 across episodes: every episode has a fixed range of the grid, rewarded by J_mean."""
    grid = tuple(float(rho) for rho in FLOCK_GRID)
    jobs = seed_jobs(SWEEP, FlockScenario(), grid, first_seeds(TUNING, num_flocks))
    values = runner.groups({"": jobs}, "Fixed ranges")[""]["min_mean_distance"]
    rng = np.random.default_rng(0)
    most, means = [], []
    for _ in range(runs):
        shuffled = values[:, rng.permutation(num_flocks)]
        pulled = across_episodes(shuffled, ACROSS_EXPLORATION)
        most.append(grid[int(np.bincount(pulled).argmax())])
        means.append(shuffled[pulled, np.arange(num_flocks)].mean())
    best = int(values.mean(axis=1).argmax())
    return AcrossEpisodes(
        episodes=num_flocks,
        runs=runs,
        most_pulled={f"{rho:g}": most.count(rho) / runs for rho in sorted(set(most))},
        fixed_range=grid[best],
        mean=stats.mean(np.array(means)),
        best=float(values[best].mean()),
    )
