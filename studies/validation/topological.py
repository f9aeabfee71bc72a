"""Ballerini et al. 2008: under attack, a topological flock splits less than a metric one of equal degree.

M. Ballerini et al., "Interaction ruling animal collective behavior depends on topological rather than metric
distance: evidence from a field study", PNAS 105 (2008) 1232.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env import (
    AlignedHeadings,
    ConstantVelocity,
    Disc,
    FlockScenario,
    Metric,
    PreferredDistance,
    Topological,
    component_labels,
    neighbor_pairs,
    simulate,
)
from flockesc_env.benchmark.seeds import HELD_OUT, TUNING, first_seeds
from flockesc_env.common import stats
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.jobs import Arrays, Job
from flockesc_env.render.palette import LIGHT
from studies.measurements import chunks
from studies.style import letter
from studies.validation.results import Verdict, scaled
from training.figure_style import WIDTH

TITLE: Final = "Topological against metric neighbors under attack"
PUBLISHED: Final = (
    "at equal mean degree, metric flocks most often split into five, topological ones stay whole"
    " ([Ballerini et al. 2008](https://doi.org/10.1073/pnas.0711437105))"
)

NUM_AGENTS: Final = 200
DISTANCE: Final = 5.0
"""Preferred distance in m."""

NEIGHBORS: Final = 7
"""k of the topological flock, and mean degree of the metric one."""

WIDTHS: Final = (1.0, 2.5)
"""Widths in m of the force: it is steep or gentle around the preferred distance."""

ATTACKS: Final = (0.0, 5.0, 10.0, 15.0)
"""Predator ranges in m; 0: no attack."""

RANGES: Final = tuple(round(5.5 + 0.1 * step, 1) for step in range(26))
"""Metric ranges in m, among which one has the mean degree."""

LINK: Final = 2 * DISTANCE
"""Distance in m within which two agents are in the same part of a flock."""

TUNING_FLOCKS: Final = 10
FLOCKS: Final = 100


@dataclass(frozen=True)
class Split:
    """Outcomes of one attack on one kind of flock: share that is whole, and the number of parts."""

    whole: Estimate
    parts: Estimate


@dataclass(frozen=True)
class Comparison:
    """Both kinds of flocks with one width of the force; splits and differences by ``ATTACKS``.

    ``degree`` and ``spacing`` (mean distance in m to the nearest agent) are those of the metric and the
    topological flock before the attack. ``difference`` is the share of whole topological flocks minus that of
    metric ones, paired.
    """

    metric_range: float
    degree: tuple[Estimate, Estimate]
    spacing: tuple[Estimate, Estimate]
    metric: tuple[Split, ...]
    topological: tuple[Split, ...]
    difference: tuple[Estimate, ...]


@dataclass(frozen=True)
class TopologicalFlocks:
    """Comparisons by ``WIDTHS``."""

    num_flocks: int
    comparisons: tuple[Comparison, ...]


def scenario(width: float, rule: Metric | Topological, **changes: Any) -> FlockScenario:
    """Return a flock that keeps together, without a predator."""
    return FlockScenario(
        **{
            "num_agents": NUM_AGENTS,
            "num_steps": 400,
            "motion": PreferredDistance(strength=1.0, distance=DISTANCE, width=width),
            "angular_noise": 0.3,
            "neighbor_rule": rule,
            "initial_positions": Disc(radius=DISTANCE * math.sqrt(NUM_AGENTS / math.pi)),
            "initial_headings": AlignedHeadings(direction=(1.0, 0.0), max_angle=0.5),
            "predators": (),
            **changes,
        }
    )


def degrees(width: float, seeds: range) -> Arrays:
    """Return the mean number of neighbors of metric flocks that have settled, shape (ranges, seeds)."""
    flock = scenario(width, Metric())
    return {"degree": np.array([[_settled(flock, rho, seed)[2] for seed in seeds] for rho in RANGES])}


def attacked(width: float, rule: Metric | Topological, rho: float, seeds: range) -> Arrays:
    """Return degree and spacing, shape (seeds,), and the number of parts, shape (attacks, seeds)."""
    flock = scenario(width, rule)
    before, parts = [], []
    for seed in seeds:
        positions, velocities, degree = _settled(flock, rho, seed)
        distances = np.linalg.norm(positions[:, None] - positions, axis=2)
        before.append((degree, np.sort(distances)[:, 1].mean()))
        # The predator meets the flock head on.
        mean = velocities.mean(axis=0)
        ahead = mean / np.linalg.norm(mean)
        start = tuple((positions.mean(axis=0) + 60 * ahead).tolist())
        predator = ConstantVelocity(start, tuple((-10 * ahead).tolist()))
        runs = (
            simulate(
                scenario(width, rule, predators=(predator,), predator_range=reach),
                rho,
                seed=seed,
                initial_positions=positions,
                initial_velocities=velocities,
            )
            for reach in ATTACKS
        )
        parts.append([len(np.unique(component_labels(None, run.positions[-1], LINK))) for run in runs])
    degree, spacing = np.array(before).T
    return {"degree": degree, "spacing": spacing, "parts": np.array(parts).T}


def _settled(flock: FlockScenario, rho: float, seed: int) -> tuple[FloatArray, FloatArray, float]:
    """Return positions, velocities and mean degree of a flock before the attack."""
    run = simulate(flock, rho, seed=seed)
    degree = len(neighbor_pairs(flock, run.positions[-1], rho)) / NUM_AGENTS
    return run.positions[-1], run.velocities[-1], degree


def comparison(width: float, num_flocks: int) -> Arrays:
    """Choose the metric range on tuning flocks, and attack held-out flocks of both kinds."""
    tuning = degrees(width, first_seeds(TUNING, TUNING_FLOCKS))["degree"].mean(axis=1)
    rho = RANGES[int(np.abs(tuning - NEIGHBORS).argmin())]
    found = {"range": np.array([rho])}
    for name, rule, action in (("metric", Metric(), rho), ("topological", Topological(), float(NEIGHBORS))):
        parts = [
            attacked(width, rule, action, seeds) for seeds in chunks(first_seeds(HELD_OUT, num_flocks), 20)
        ]
        found |= {f"{name} {key}": np.concatenate([part[key] for part in parts], axis=-1) for key in parts[0]}
    return found


def jobs(scale: float) -> dict[float, Job]:
    """Return a job per width of the force, for ``results``."""
    call = f"{__name__}:comparison"
    return {width: Job(call, (width, scaled(FLOCKS, scale)), 180 * scale) for width in WIDTHS}


def results(measured: Mapping[float, Arrays]) -> TopologicalFlocks:
    """Return the results of the jobs of ``jobs``."""
    return TopologicalFlocks(
        num_flocks=measured[WIDTHS[0]]["metric degree"].size,
        comparisons=tuple(_comparison(measured[width]) for width in WIDTHS),
    )


def _comparison(found: Arrays) -> Comparison:
    parts = {name: found[f"{name} parts"] for name in ("metric", "topological")}
    splits = {
        name: tuple(Split(stats.share(row == 1), stats.mean(row.astype(float))) for row in rows)
        for name, rows in parts.items()
    }
    whole = {name: (rows == 1).astype(float) for name, rows in parts.items()}
    return Comparison(
        metric_range=float(found["range"][0]),
        degree=(stats.mean(found["metric degree"]), stats.mean(found["topological degree"])),
        spacing=(stats.mean(found["metric spacing"]), stats.mean(found["topological spacing"])),
        metric=splits["metric"],
        topological=splits["topological"],
        difference=tuple(stats.mean(row) for row in whole["topological"] - whole["metric"]),
    )


def here(results: TopologicalFlocks) -> str:
    """Return the numbers of parts under the strongest attack and without one."""
    first = results.comparisons[0]
    attack, peace = ([each[at].parts.mean for each in (first.metric, first.topological)] for at in (-1, 0))
    return (
        f"metric flocks split into {attack[0]:.1f} parts and topological ones into {attack[1]:.1f}"
        f"; without an attack into {peace[0]:.1f} and {peace[1]:.1f}"
    )


def verdict(results: TopologicalFlocks) -> Verdict:
    """Return the verdict: more topological than metric flocks stay whole, but only under attack."""
    attacks = [difference for each in results.comparisons for difference in each.difference[1:]]
    peace = [each.difference[0] for each in results.comparisons]
    if any(difference.low > 0 for difference in peace):
        return Verdict.OPEN
    return Verdict.AGREES if all(difference.low > 0 for difference in attacks) else Verdict.DIFFERS


def figure(results: TopologicalFlocks) -> Figure:
    """Draw the share of whole flocks against the predator's range, a panel per width of the force."""
    figure = Figure(figsize=(WIDTH, 2.9), layout="constrained")
    panels = figure.subplots(1, len(WIDTHS), sharey=True)
    for index, (axes, width, each) in enumerate(zip(panels, WIDTHS, results.comparisons, strict=True)):
        for name, splits, color in (
            ("topological", each.topological, LIGHT.others[0]),
            ("metric", each.metric, LIGHT.others[1]),
        ):
            whole = [split.whole for split in splits]
            errors = [[e.mean - e.low for e in whole], [e.high - e.mean for e in whole]]
            axes.errorbar(
                ATTACKS, [e.mean for e in whole], errors, fmt="o-", color=color, capsize=3, label=name
            )
        axes.set(xlabel="predator range (m), 0: no attack", ylim=(-0.02, 1.02))
        letter(axes, index, f"width of the force {width:g} m")
    panels[0].set_ylabel("share of flocks that are whole")
    panels[0].legend()
    return figure
