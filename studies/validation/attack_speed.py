"""Mateo et al. 2017: the best number of neighbors against the predator's speed, under the topological rule.

Mateo, Kuan and Bouffanais, "Effect of correlations in swarms on collective response" (2017).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from flockesc_env import ConstantVelocity, FlockScenario, Topological
from flockesc_env.benchmark.seeds import HELD_OUT, TUNING, first_seeds
from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays, Job
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
from flockesc_env.render.palette import LIGHT
from studies.pages import compared
from studies.robustness.findings import OBJECTIVES
from studies.style import curve, letter
from studies.validation.results import Verdict, scaled
from training.figure_style import WIDTH, label_ends

TITLE: Final = "The best number of neighbors against the predator's speed"
PUBLISHED: Final = (
    "more neighbors improve the response to slow perturbations of static networks and worsen it to fast ones"
    " ([Mateo et al. 2017](https://doi.org/10.1038/s41598-017-09830-w))"
)

NUM_FLOCKS: Final = 200
"""Held-out flocks per speed."""

SPEEDS: Final = (0.5, 1.0, 2.0, 4.0)
"""Speeds of the predator, in units of the paper's."""

NEIGHBORS: Final = (1, 2, 3, 4, 5, 7, 10, 14, 20, 30, 45, 70, 100)
"""Values of k."""

CHECK_FLOCKS: Final = 10
"""Tuning flocks that also run twice as long."""

TUNING_SHARE: Final = 2
"""Held-out flocks per tuning flock."""

FEW: Final = 30
"""Largest k of the sentence about few neighbors."""


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


def jobs(scale: float) -> dict[str, list[Job]]:
    """Return the jobs by speed and purpose, for ``results``."""
    num_flocks = scaled(NUM_FLOCKS, scale)
    actions = tuple(float(k) for k in NEIGHBORS)
    tuning = first_seeds(TUNING, num_flocks // TUNING_SHARE)
    held_out = first_seeds(HELD_OUT, num_flocks)
    few = tuning[:CHECK_FLOCKS]
    found = {}
    for speed in SPEEDS:
        found[f"tuning {speed}"] = seed_jobs(SWEEP, scenario(speed), actions, tuning)
        found[f"held out {speed}"] = seed_jobs(SWEEP, scenario(speed), actions, held_out)
        found[f"longer {speed}"] = seed_jobs(SWEEP, scenario(speed, longer=2), actions, few)
    return found


def results(measured: Mapping[str, Arrays]) -> AttackSpeed:
    """Return the results of the jobs of ``jobs``."""
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


def sign_changes(best: Sequence[Best]) -> Verdict:
    """Return whether many neighbors gain against the slowest predator and lose against the fastest."""
    slow, fast = (compared(row.curve[-1]) for row in (best[0], best[-1]))
    if (slow, fast) == ("larger", "smaller"):
        return Verdict.AGREES
    return Verdict.DIFFERS if slow == "smaller" or fast == "larger" else Verdict.OPEN


def here(results: AttackSpeed) -> str:
    """Return, by objective, whether the gain of many neighbors changes its sign."""
    return "; ".join(f"{symbol}: {sign_changes(best)}" for symbol, best in results.best.items())


def verdict(results: AttackSpeed) -> Verdict:
    """Return the verdict of the objectives if it is the same for all of them."""
    verdicts = {sign_changes(best) for best in results.best.values()}
    return verdicts.pop() if len(verdicts) == 1 else Verdict.OPEN


def seconds() -> dict[float, float]:
    """Return the duration of an episode in s, by speed."""
    return {speed: scenario(speed).num_steps * scenario(speed).time_step for speed in SPEEDS}


def changes(values: tuple[float, ...]) -> str:
    """Return changes in m by speed, without zeros, as text."""
    shown = [f"{value:.2f} m at {speed:g}x" for speed, value in zip(SPEEDS, values, strict=True)]
    return ", ".join(text for text, value in zip(shown, values, strict=True) if value) or "0"


def few_change(best: Sequence[Best]) -> float:
    """Return the largest change in m of a mean objective from k = 1 to any k <= ``FEW``, at any speed."""
    few = NEIGHBORS.index(FEW) + 1
    return max(abs(change.mean) for row in best for change in row.curve[:few])


def signs(best: Sequence[Best]) -> dict[str, str]:
    """Return the speeds at which the gain of many neighbors is larger than 0, smaller, and neither."""
    words = [compared(row.curve[-1]) for row in best]
    return {word: _at(one == word for one in words) for word in dict.fromkeys(words)}


def refuted(best: Sequence[Best]) -> str:
    """Return the speeds at which held-out flocks refute the best k; empty: none."""
    return _at(row.is_refuted for row in best)


def unresolved(results: AttackSpeed) -> list[tuple[float, float, float]]:
    """Return speeds whose largest mean J_min is below the predator's step, with both lengths in m."""
    found = zip(SPEEDS, results.best["J_min"], strict=True)
    return [
        (speed, row.largest, step_length(speed)) for speed, row in found if row.largest < step_length(speed)
    ]


def _at(is_so: Iterable[bool]) -> str:
    """Return the speeds at which something is so, as text; empty: at none."""
    names = [f"{speed:g}x" for speed, so in zip(SPEEDS, is_so, strict=True) if so]
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def figure(results: AttackSpeed) -> Figure:
    """Draw the gain over k = 1 against k; a dot marks the best k on tuning flocks."""
    drawn = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    panels = drawn.subplots(1, len(results.best))
    for index, (axes, (symbol, best)) in enumerate(zip(panels, results.best.items(), strict=True)):
        ends = []
        for color, speed, row in zip(LIGHT.others, SPEEDS, best, strict=False):
            curve(axes, NEIGHBORS, row.curve, color, band=0.12, lw=1.8)
            axes.plot(row.neighbors.mean, row.chosen.mean, "o", color=color, ms=6.5, zorder=3)
            ends.append((row.curve[-1].mean, f"{speed:g}x", color))
        axes.axhline(0, color=LIGHT.muted, lw=0.8, zorder=1)
        axes.set_xscale("log")
        axes.set_xticks((1, 2, 4, 7, 14, 30, 100), ("1", "2", "4", "7", "14", "30", "100"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("number of neighbors k")
        axes.set_ylabel(f"{symbol} minus {symbol} at k = 1 (m)")
        axes.grid(axis="y")
        letter(axes, index, f"{symbol}, by the speed of the predator")
        label_ends(axes, ends)
    return drawn
