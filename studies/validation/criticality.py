"""Klamser and Romanczuk 2021: prey are caught least near the transition between disorder and order.

P. P. Klamser and P. Romanczuk, "Collective predator evasion: putting the criticality hypothesis to the test",
PLOS Comput. Biol. 17 (2021) e1008832. Constants of the prey are those of the authors' code,
PaPeK/PredatorPrey.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import FlockScenario, simulate
from flockesc_env.common.stats import Estimate, FloatArray, argmax, mean
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario import AlignedHeadings, Disc, PreferredDistance, PurePursuit, Voronoi
from studies.measurements import by_name, means, share_of, split
from studies.style import curve, letter, subplots
from studies.validation import Verdict

ALIGNMENTS: Final = (0.0, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 5.0)  # strengths of alignment
NUM_AGENTS: Final = 200
DIFFUSION: Final = 0.5  # rotational diffusion coefficient of the headings in rad^2/s
STEP: Final = 0.05
SETTLING: Final = 2_500  # steps before the attack; order is averaged over the second half
ATTACK: Final = 1_200  # steps
FLEEING: Final = 4.0  # strength of the escape force; the control has none
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
    """Return what ``attack`` measures in some schools, by name, shape (seeds,)."""
    return by_name([attack(alignment, seed) for seed in seeds])


def attack(alignment: float, seed: int) -> dict[str, float]:
    """Let a school settle, and let a predator pursue agents that flee and agents that do not.

    Returns:
        ``order`` and ``variance`` before the attack, ``captured`` and ``captured_still``, and ``spacing``,
        the mean distance to the nearest agent; see ``Criticality``.
    """
    school = SCHOOL.replace(alignment_strength=alignment)
    settled = simulate(school, EVERYWHERE, seed=seed)
    order = settled.polarization[SETTLING // 2 :]
    positions = settled.positions[-1]
    state = {"initial_positions": positions, "initial_velocities": settled.velocities[-1]}
    predators = (predator_outside(positions, seed),)
    attacked = school.replace(num_steps=ATTACK, predators=predators, capture_radius=CAPTURE_RADIUS)

    def captured(strength: float) -> float:
        run = simulate(attacked.replace(repulsion_strength=strength), EVERYWHERE, seed=seed, **state)
        return float((run.caught_at >= 0).sum())

    distances = np.linalg.norm(positions[:, None] - positions, axis=2)
    nearest = np.sort(distances)[:, 1]  # behind the distance to itself
    return {
        "order": order.mean(),
        "variance": NUM_AGENTS * order.var(),
        "captured": captured(FLEEING),
        "captured_still": captured(0.0),
        "spacing": nearest.mean(),
    }


def predator_outside(positions: FloatArray, seed: int) -> PurePursuit:
    """Return a predator in a random direction from the school, 4.5 outside of it as in the authors' code."""
    center = positions.mean(axis=0)
    angle = np.random.default_rng(seed).uniform(0, 2 * math.pi)
    outward = np.array([math.cos(angle), math.sin(angle)])
    edge = ((positions - center) @ outward).max()
    start = center + outward * (edge + 4.5)
    return PurePursuit(tuple(start.tolist()), tuple((-2 * outward).tolist()), max_turn_rate=1.0)


def jobs(scale: float) -> dict[float, list[Job]]:
    """Return the jobs by alignment, for ``results``."""
    seeds = share_of(HELD_OUT, FLOCKS, scale, least=4)
    return {a: split(measure, a, flocks=seeds, size=4, seconds=4.0) for a in ALIGNMENTS}


def results(measured: Mapping[float, Arrays]) -> Criticality:
    """Return the results of the jobs of ``jobs``."""
    found = by_name([measured[alignment] for alignment in ALIGNMENTS])  # shape (alignments, flocks)
    captured, still = found["captured"], found["captured_still"]
    alignments = np.array(ALIGNMENTS)
    transition = argmax(alignments, found["variance"])
    at_transition = captured[ALIGNMENTS.index(transition.mean)]
    avoided = (still - captured) / still.mean(axis=1, keepdims=True)
    return Criticality(
        num_flocks=captured.shape[1],
        **{name: means(rows) for name, rows in found.items()},
        transition=transition,
        best=argmax(alignments, -captured),
        best_still=argmax(alignments, -still),
        disordered=mean(captured[0] - at_transition),
        ordered=mean(captured[-1] - at_transition),
        avoided=means(avoided),
        average_avoided=mean(avoided.mean(axis=0)),
    )


def obstacles(results: Criticality) -> list[str]:
    """Return why the result cannot be judged: the conditions that fail."""
    found = []
    avoided = results.average_avoided
    if avoided.low <= 0:
        found.append(f"flight avoids a share of {avoided} of the captures")
    best, count = results.best, len(ALIGNMENTS)
    covered = sum(best.low <= alignment <= best.high for alignment in ALIGNMENTS)
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
