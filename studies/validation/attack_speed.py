"""The best number of neighbors against the predator's speed, under the topological rule."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from flockesc_env import ConstantVelocity, FlockScenario, Topological
from flockesc_env.benchmark.seeds import HELD_OUT, TUNING, first_seeds
from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays, Job
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
from studies.robustness.findings import OBJECTIVES

SPEEDS: Final = (0.5, 1.0, 2.0, 4.0)
"""Speeds of the predator, in units of the paper's."""

NEIGHBORS: Final = (1, 2, 3, 4, 5, 7, 10, 14, 20, 30, 45, 70, 100)
"""Values of k."""

CHECK_FLOCKS: Final = 10
"""Tuning flocks that also run twice as long."""

TUNING_SHARE: Final = 2
"""Held-out flocks per tuning flock."""


@dataclass(frozen=True)
class Best:
    """The best k for one objective at one speed.

    ``neighbors`` has the largest mean on tuning flocks; its interval is that of the best k on all flocks.
    Everything else is in m and measured on held-out flocks: the objective, its paired difference to that at
    the largest k, and the paired differences of the objective at every k to that at the smallest.
    """

    neighbors: Estimate
    value: Estimate
    gain_over_most: Estimate
    curve: tuple[Estimate, ...]

    @property
    def chosen(self) -> Estimate:
        """The entry of ``curve`` at the best k."""
        return self.curve[NEIGHBORS.index(int(self.neighbors.mean))]

    @property
    def largest(self) -> float:
        """The largest mean of the objective over all k on held-out flocks, in m."""
        return self.value.mean - self.chosen.mean + max(change.mean for change in self.curve)

    @property
    def is_refuted(self) -> bool:
        """Whether the k that is best on tuning flocks is worse than the smallest on held-out flocks."""
        return self.chosen.high < 0


@dataclass(frozen=True)
class AttackSpeed:
    """Results of the study, by objective; ``best`` and ``longer`` have an entry per speed.

    ``falls`` is the share of bootstrap resamples of the flocks in which k is smaller at the fastest predator
    than at the slowest. ``longer`` is the largest change in m of a mean over ``CHECK_FLOCKS`` flocks, over
    all values of k, if the episode lasts twice as long.
    """

    num_flocks: int
    tuning_flocks: int
    best: dict[str, tuple[Best, ...]]
    falls: dict[str, float]
    longer: dict[str, tuple[float, ...]]


def scenario(speed: float, *, longer: int = 1) -> FlockScenario:
    """Return the paper's flock with topological neighbors and a predator of another speed.

    The paper's predator and slower ones get twice the paper's time: some flocks fly ahead of them.
    """
    paper = FlockScenario()
    (given,) = (p.velocity for p in paper.predators if isinstance(p, ConstantVelocity))
    velocity = tuple(speed * component for component in given or ())
    steps = paper.num_steps * (2 if speed <= 1 else 1) * longer
    return paper.replace(
        predators=(ConstantVelocity(velocity=velocity),), neighbor_rule=Topological(), num_steps=steps
    )


def step_length(speed: float) -> float:
    """Return how far the predator flies in a time step, in m."""
    (predator,) = scenario(speed).predators
    assert isinstance(predator, ConstantVelocity)  # noqa: S101, see ``scenario``
    return float(np.linalg.norm(predator.velocity or ())) * scenario(speed).time_step


def attack_jobs(num_flocks: int) -> dict[str, list[Job]]:
    """Return the jobs by speed and purpose, for ``attack_results``."""
    actions = tuple(float(k) for k in NEIGHBORS)
    tuning = first_seeds(TUNING, num_flocks // TUNING_SHARE)
    held_out = first_seeds(HELD_OUT, num_flocks)
    few = tuning[:CHECK_FLOCKS]
    jobs = {}
    for speed in SPEEDS:
        jobs[f"tuning {speed}"] = seed_jobs(SWEEP, scenario(speed), actions, tuning)
        jobs[f"held out {speed}"] = seed_jobs(SWEEP, scenario(speed), actions, held_out)
        jobs[f"longer {speed}"] = seed_jobs(SWEEP, scenario(speed, longer=2), actions, few)
    return jobs


def attack_results(measured: Mapping[str, Arrays]) -> AttackSpeed:
    """Return the results of the jobs of ``attack_jobs``."""
    tuning = _by_objective(measured, "tuning")
    held_out = _by_objective(measured, "held out")
    longer = _by_objective(measured, "longer")
    every = {symbol: np.concatenate([values, held_out[symbol]], axis=2) for symbol, values in tuning.items()}
    changes = {
        symbol: np.abs((values - tuning[symbol][:, :, : values.shape[2]]).mean(axis=2)).max(axis=1)
        for symbol, values in longer.items()
    }
    return AttackSpeed(
        num_flocks=held_out["J_mean"].shape[2],
        tuning_flocks=tuning["J_mean"].shape[2],
        best={symbol: _best(values, held_out[symbol]) for symbol, values in tuning.items()},
        falls={symbol: falls(values[0], values[-1]) for symbol, values in every.items()},
        longer={symbol: tuple(change.tolist()) for symbol, change in changes.items()},
    )


def falls(slow: FloatArray, fast: FloatArray, resamples: int = 2_000) -> float:
    """Return the share of resamples of the flocks in which the best action is smaller in ``fast``."""
    drawn = np.random.default_rng(0).integers(slow.shape[1], size=(resamples, slow.shape[1]))
    best = [[values[:, flocks].mean(axis=1).argmax() for flocks in drawn] for values in (slow, fast)]
    return float(np.mean(np.array(best[1]) < np.array(best[0])))


def _by_objective(measured: Mapping[str, Arrays], purpose: str) -> dict[str, FloatArray]:
    """Return the objectives, shape (speeds, k, flocks)."""
    return {
        symbol: np.stack([measured[f"{purpose} {speed}"][column] for speed in SPEEDS])
        for symbol, column in OBJECTIVES.items()
    }


def _best(tuning: FloatArray, held_out: FloatArray) -> tuple[Best, ...]:
    places = tuning.mean(axis=2).argmax(axis=1)
    every = np.concatenate([tuning, held_out], axis=2)
    intervals = [stats.argmax(np.array(NEIGHBORS, float), values) for values in every]
    return tuple(
        Best(
            neighbors=Estimate(float(NEIGHBORS[place]), interval.low, interval.high),
            value=stats.mean(values[place]),
            gain_over_most=stats.mean(values[place] - values[-1]),
            curve=tuple(stats.mean(row - values[0]) for row in values),
        )
        for place, interval, values in zip(places, intervals, held_out, strict=True)
    )
