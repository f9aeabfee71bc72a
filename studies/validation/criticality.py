"""Klamser and Romanczuk 2021: prey are caught least near the transition between disorder and order.

P. P. Klamser and P. Romanczuk, "Collective predator evasion: putting the criticality hypothesis to the test",
PLOS Comput. Biol. 17 (2021) e1008832. Constants of the prey are those of the authors' code,
PaPeK/PredatorPrey.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario, simulate
from flockesc_env.common.stats import Estimate, argmax, mean
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario import AlignedHeadings, Disc, PreferredDistance, PurePursuit, Voronoi
from studies.measurements import means, share_of, split
from studies.style import curve, letter, subplots
from studies.validation import Verdict

ALIGNMENTS: Final = (0.0, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 5.0)
"""Strengths of alignment."""

NUM_AGENTS: Final = 200
DIFFUSION: Final = 0.5  # rotational diffusion coefficient of the headings in rad^2/s
STEP: Final = 0.05
SETTLING: Final = 2_500  # steps before the attack; order is averaged over the second half
ATTACK: Final = 1_200  # steps
FLEEING: Final = (4.0, 0.0)  # strengths of the escape force: the paper's, and the control's
CAPTURE_RADIUS: Final = 0.2
EVERYWHERE: Final = 1e3
FLOCKS: Final = 16


@dataclass(frozen=True)
class Criticality:
    """Order, captures and spacing, by ``ALIGNMENTS``.

    ``variance`` is N times the variance over time of the polarization. ``captured`` counts agents that flee,
    ``captured_still`` agents that do not. ``transition`` is the alignment with the largest variance, ``best``
    and ``best_still`` those with the fewest captures. ``disordered`` and ``ordered`` are captures at the
    first and the last alignment minus those at the transition, paired. ``avoided`` is 1 minus the ratio of
    mean captures with and without flight, and ``average_avoided`` its mean over ``ALIGNMENTS``.
    """

    num_flocks: int
    order: tuple[Estimate, ...]
    variance: tuple[Estimate, ...]
    captured: tuple[Estimate, ...]
    captured_still: tuple[Estimate, ...]
    spacing: tuple[Estimate, ...]
    transition: Estimate
    best: Estimate
    best_still: Estimate
    disordered: Estimate
    ordered: Estimate
    avoided: tuple[Estimate, ...]
    average_avoided: Estimate


SCHOOL: Final = FlockScenario(
    num_agents=NUM_AGENTS,
    num_steps=SETTLING,
    time_step=STEP,
    mass=1.0,
    speed=1.0,
    motion=PreferredDistance(strength=2.0, distance=1.0, width=0.5),
    # The variance of a step's uniform error is that of the diffusion.
    angular_noise=math.sqrt(24 * DIFFUSION * STEP),
    neighbor_rule=Voronoi(),
    initial_side=20.0,
    initial_positions=Disc(radius=8.0),
    initial_headings=AlignedHeadings(direction=(1.0, 0.0), max_angle=1.0),
    predator_range=2.0,
    predators=(),
)
"""The school of the paper, in its units of length and speed, without a predator."""


def measure(alignment: float, seeds: range) -> Arrays:
    """Return order, variance, captures with and without flight, and spacing, shape (5, seeds)."""
    return {"numbers": np.array([_measure(alignment, seed) for seed in seeds]).T}


def _measure(alignment: float, seed: int) -> tuple[float, ...]:
    school = SCHOOL.replace(alignment_strength=alignment)
    settled = simulate(school, EVERYWHERE, seed=seed)
    order = settled.polarization[SETTLING // 2 :]
    positions, velocities = settled.positions[-1], settled.velocities[-1]
    distances = np.linalg.norm(positions[:, None] - positions, axis=2)
    center = positions.mean(axis=0)
    angle = np.random.default_rng(seed).uniform(0, 2 * math.pi)
    outward = np.array([math.cos(angle), math.sin(angle)])
    # It starts 4.5 outside of the school, as in the authors' code.
    start = center + outward * (((positions - center) @ outward).max() + 4.5)
    predator = PurePursuit(tuple(start.tolist()), tuple((-2 * outward).tolist()), max_turn_rate=1.0)
    attacked = school.replace(num_steps=ATTACK, predators=(predator,), capture_radius=CAPTURE_RADIUS)
    state = {"initial_positions": positions, "initial_velocities": velocities}
    caught = []
    for strength in FLEEING:
        run = simulate(attacked.replace(repulsion_strength=strength), EVERYWHERE, seed=seed, **state)
        caught.append(float((run.caught_at >= 0).sum()))
    return order.mean(), NUM_AGENTS * order.var(), *caught, np.sort(distances)[:, 1].mean()


def jobs(scale: float) -> dict[float, list[Job]]:
    """Return the jobs by alignment, for ``results``."""
    seeds = share_of(HELD_OUT, FLOCKS, scale, 4)
    return {a: split(f"{__name__}:measure", (a,), seeds, 4, 4.0) for a in ALIGNMENTS}


def results(measured: Mapping[float, Arrays]) -> Criticality:
    """Return the results of the jobs of ``jobs``."""
    numbers = [measured[alignment]["numbers"] for alignment in ALIGNMENTS]
    order, variance, captured, still, spacing = np.stack(numbers, axis=1)
    at = np.array(ALIGNMENTS)
    transition = argmax(at, variance)
    critical = captured[ALIGNMENTS.index(transition.mean)]
    avoided = (still - captured) / still.mean(axis=1, keepdims=True)
    return Criticality(
        num_flocks=order.shape[1],
        order=means(order),
        variance=means(variance),
        captured=means(captured),
        captured_still=means(still),
        spacing=means(spacing),
        transition=transition,
        best=argmax(at, -captured),
        best_still=argmax(at, -still),
        disordered=mean(captured[0] - critical),
        ordered=mean(captured[-1] - critical),
        avoided=means(avoided),
        average_avoided=mean(avoided.mean(axis=0)),
    )


def obstacles(results: Criticality) -> list[str]:
    """Return why the result cannot be judged: the conditions that fail."""
    found, avoided, best = [], results.average_avoided, results.best
    if avoided.low <= 0:
        found.append(f"flight avoids a share of {avoided} of the captures")
    covered, count = sum(best.low <= each <= best.high for each in ALIGNMENTS), len(ALIGNMENTS)
    if 2 * covered >= count:
        found.append(f"the interval of the fewest captures covers {covered} of {count} alignments")
    return found


def verdict(results: Criticality) -> Verdict:
    """Return the verdict: fewest captures at the transition, with and without flight."""
    if obstacles(results):
        return Verdict.CANNOT_BE_JUDGED
    low, high = results.transition.low, results.transition.high
    at_transition = all(best.low <= high and best.high >= low for best in (results.best, results.best_still))
    is_less = results.disordered.low > 0 and results.ordered.low > 0
    return Verdict.of(at_transition, is_less)


def figure(results: Criticality) -> Figure:
    """Draw order, captures and spacing against the alignment; the line is the transition."""
    figure, panels = subplots(2.9, 1, 3)
    for axes, rows, color, label in (
        (panels[0], results.order, LIGHT.ink, "polarization"),
        (panels[0], results.variance, LIGHT.others[0], "N x variance"),
        (panels[1], results.captured, LIGHT.predator, "prey flee"),
        (panels[1], results.captured_still, LIGHT.muted, "they do not"),
        (panels[2], results.spacing, LIGHT.ink, ""),
    ):
        curve(axes, ALIGNMENTS, rows, color, ".-", band=0.15, label=label)
    titles = ("order", "caught agents", "distance to the nearest")
    for index, (axes, title) in enumerate(zip(panels, titles, strict=True)):
        axes.axvline(results.transition.mean, color=LIGHT.muted, ls="--", lw=1)
        axes.set_xlabel("strength of alignment")
        axes.set_ylim(bottom=0)
        letter(axes, index, title)
    for axes in panels[:2]:
        axes.legend()
    return figure
