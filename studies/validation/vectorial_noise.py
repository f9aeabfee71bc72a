"""Gregoire and Chate 2004: under vectorial noise the transition to order is discontinuous.

Gregoire and Chate, "Onset of collective and cohesive motion" (2004); Chate, Ginelli, Gregoire and Raynaud,
"Collective motion of self-propelled particles interacting without cohesion" (2008).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import RandomHeadings
from flockesc_env.benchmark.seeds import HELD_OUT, first_seeds
from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from studies.measurements import chunks
from studies.style import curve, letter
from studies.validation.results import Verdict, scaled
from studies.validation.vicsek import periodic_flock
from training.figure_style import WIDTH, label_ends

TITLE: Final = "Discontinuous transition under vectorial noise"
PUBLISHED: Final = (
    "the Binder cumulant dips below 0, and order has hysteresis"
    " ([Grégoire and Chaté 2004](https://doi.org/10.1103/PhysRevLett.92.025702))"
)

NUM_AGENTS: Final = 1_024
DENSITY: Final = 2.0
"""Agents per square of the interaction range."""

NOISES: Final = {
    "sensing_noise": (0.61, 0.615, 0.62, 0.6225, 0.625, 0.6275, 0.63, 0.635),
    "angular_noise": (2.8, 3.2, 3.4, 3.6, 3.8, 4.0, 4.4, 4.8),
}
"""Strengths of the vectorial noise and, for the control, of the angular noise; from tuning flocks."""

NUM_STEPS: Final = 3_000
SKIP: Final = 500
FLOCKS: Final = {"sensing_noise": 16, "angular_noise": 4}


@dataclass(frozen=True)
class Transition:
    """Order by noise, of flocks that start with random and with aligned headings.

    ``cumulant`` is the Binder cumulant of the flocks that start with random headings, by noise, and ``dip``
    its minimum. ``hysteresis`` is the mean over noises of the order of aligned minus random starts.
    """

    random: tuple[Estimate, ...]
    aligned: tuple[Estimate, ...]
    cumulant: tuple[Estimate, ...]
    dip: Estimate
    hysteresis: Estimate
    num_flocks: int

    @property
    def num_negative(self) -> int:
        """The number of noises at which the interval of the cumulant is below 0."""
        return sum(each.high < 0 for each in self.cumulant)


@dataclass(frozen=True)
class VectorialNoise:
    """Transitions by the noise that causes them."""

    transitions: dict[str, Transition]


def jobs(scale: float) -> dict[str, list[Job]]:
    """Return the jobs by noise and start, for ``results``."""
    starts: dict[str, dict[str, Any]] = {"random": {"initial_headings": RandomHeadings()}, "aligned": {}}
    flocks = {
        start: periodic_flock(NUM_AGENTS, DENSITY, speed=0.5, num_steps=NUM_STEPS, **fields)
        for start, fields in starts.items()
    }
    return {
        f"{noise} {start}": [
            Job("studies.validation.vicsek:moments", (flock, noise, strengths, SKIP, seeds), 20.0)
            for seeds in chunks(first_seeds(HELD_OUT, scaled(FLOCKS[noise], scale)), 1)
        ]
        for noise, strengths in NOISES.items()
        for start, flock in flocks.items()
    }


def results(measured: Mapping[str, Arrays]) -> VectorialNoise:
    """Return the results of the jobs of ``jobs``."""
    return VectorialNoise(
        {noise: _transition(measured[f"{noise} random"], measured[f"{noise} aligned"]) for noise in NOISES}
    )


def _transition(random: Arrays, aligned: Arrays) -> Transition:
    resampled = cumulants(random["second"], random["fourth"])
    pooled = 1 - random["fourth"].mean(axis=1) / (3 * random["second"].mean(axis=1) ** 2)
    return Transition(
        random=tuple(stats.mean(row) for row in random["mean"]),
        aligned=tuple(stats.mean(row) for row in aligned["mean"]),
        cumulant=tuple(_estimate(*each) for each in zip(pooled, resampled, strict=True)),
        dip=_estimate(pooled.min(), resampled.min(axis=0)),
        hysteresis=stats.mean((aligned["mean"] - random["mean"]).mean(axis=0)),
        num_flocks=random["mean"].shape[1],
    )


def cumulants(second: FloatArray, fourth: FloatArray) -> FloatArray:
    """Return Binder cumulants of bootstrap resamples of flocks, shape (noises, resamples).

    Args:
        second: time means of the square of the order, shape (noises, flocks).
        fourth: time means of its fourth power, shape (noises, flocks).
    """
    num_flocks = second.shape[1]
    flocks = np.random.default_rng(0).integers(num_flocks, size=(stats.RESAMPLES, num_flocks))
    found: FloatArray = 1 - fourth[:, flocks].mean(axis=-1) / (3 * second[:, flocks].mean(axis=-1) ** 2)
    return found


def _estimate(value: float, resampled: FloatArray) -> Estimate:
    low, high = np.quantile(resampled, [0.025, 0.975])
    return Estimate(float(value), float(low), float(high))


def here(results: VectorialNoise) -> str:
    """Return hysteresis and smallest cumulants under vectorial noise and under angular noise."""
    vectorial, control = (results.transitions[noise] for noise in NOISES)
    return (
        f"hysteresis {vectorial.hysteresis:+.2f}, under angular noise {control.hysteresis:+.2f}"
        f"; smallest cumulant {vectorial.dip.mean:.2f}, under angular noise {control.dip.mean:.2f}"
    )


def verdict(results: VectorialNoise) -> Verdict:
    """Return the verdict by the rule on the page."""
    vectorial, control = (results.transitions[noise] for noise in NOISES)
    if vectorial.dip.low > 0 or vectorial.hysteresis.high < 0:
        return Verdict.DIFFERS
    # The minimum of resamples is below the cumulant of any one noise, so one noise must decide.
    is_discontinuous = vectorial.num_negative > 0 and vectorial.hysteresis.low > 0
    is_control_continuous = control.dip.low > 0 and control.hysteresis.low <= 0 <= control.hysteresis.high
    return Verdict.AGREES if is_discontinuous and is_control_continuous else Verdict.OPEN


def figure(results: VectorialNoise) -> Figure:
    """Draw order and Binder cumulant against the strength of both noises."""
    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    panels = figure.subplots(2, 2, sharex="col", sharey="row")
    titles = {"sensing_noise": "vectorial noise", "angular_noise": "angular noise, the control"}
    for column, (noise, strengths) in enumerate(NOISES.items()):
        found = results.transitions[noise]
        order, cumulant = panels[:, column]
        for color, start in zip(LIGHT.others, ("random", "aligned"), strict=False):
            curve(order, strengths, getattr(found, start), color, "o-", band=0.2, lw=1.5, ms=3, label=start)
        curve(cumulant, strengths, found.cumulant, LIGHT.ink, "o-", band=0.15, lw=1.5, ms=3)
        for level in (2 / 3, 1 / 3, 0):
            cumulant.axhline(level, color=LIGHT.accent, lw=0.8, ls=":", zorder=0)
        cumulant.set_xlabel("noise" if noise == "sensing_noise" else "noise (rad)")
        letter(order, column, titles[noise])
    panels[0, 0].set_ylabel("polarization")
    panels[0, 0].legend(title="headings at the start", loc="lower left")
    panels[1, 0].set_ylabel("Binder cumulant")
    label_ends(panels[1, 1], [(2 / 3, "order", LIGHT.accent), (1 / 3, "disorder", LIGHT.accent)])
    return figure
