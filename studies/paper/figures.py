"""The figures of the paper by number, their measurements, and the single realizations that they show."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.figure import Figure

from flockesc_env.common.errors import InputError
from flockesc_env.jobs import Arrays, Backend, Cache
from studies.measurements import Runner
from studies.paper import flock_figures, line_figures, mechanism_figures, plan
from studies.paper.flock_claims import PRINTED_BEST, PRINTED_COMPONENTS, dominates
from studies.paper.line_claims import PRINTED_CLUSTERS, clusters
from training.figure_style import save_figure

Measured = Mapping[str, Arrays]


def line_seed(measured: Measured) -> int:
    """Return the seed of the line in Figures 3 and 4, by the rule on the page."""
    finals = measured["free line"]["final"]

    def deviation(seed: int) -> float:
        worst = 0.0
        for rho, printed in PRINTED_CLUSTERS.items():
            found = clusters(finals[plan.FREE_RANGES.index(rho), seed], rho)
            if len(found) != len(printed):
                return np.inf
            worst = max(worst, float(np.abs(found - printed).max()))
        return worst

    return int(np.argmin([deviation(seed) for seed in range(finals.shape[1])]))


def flock_seed(measured: Measured) -> int:
    """Return the seed of the flock in Figures 6 to 10, by the rule on the page."""
    curves, values = measured["curves"], measured["grid flock"]["min_mean_distance"]
    at_end = curves["num_components"][plan.SHOWN_FLOCK_RANGES.index(PRINTED_BEST), :, -1]
    suits = (at_end == PRINTED_COMPONENTS) & dominates(curves["mean_distance"]).all(axis=-1)
    best = np.array(plan.FLOCK_GRID)[np.argmax(values, axis=0)]
    return int(np.argmin(np.where(suits | ~suits.any(), np.abs(best - PRINTED_BEST), np.inf)))


_FLOCKS = ("curves", "grid flock")
_OFFSETS = {offset: f"aimed {offset:g}" for offset in plan.OFFSETS}
_FORCES = {force: f"grid {force}" for force in plan.FORCES}
_STRENGTHS = tuple(
    name(plan.PAPER, strength) for name in (plan.control, plan.captures) for strength in plan.STRENGTHS
)

FIGURES: Final[dict[str, tuple[Iterable[str], Callable[[Measured], Figure]]]] = {
    "2": ((), lambda _: line_figures.escape_forces()),
    "3": (("free line",), lambda m: line_figures.lines_over_time(line_seed(m), is_attacked=False)),
    "4": (("free line",), lambda m: line_figures.lines_over_time(line_seed(m), is_attacked=True)),
    "5": (
        _FORCES.values(),
        lambda m: line_figures.distance_against_range({force: m[name] for force, name in _FORCES.items()}),
    ),
    "6": (_FLOCKS, lambda m: flock_figures.snapshots(flock_seed(m), 100.0)),
    "7": (_FLOCKS, lambda m: flock_figures.snapshots(flock_seed(m), 10.0)),
    "8": (_FLOCKS, lambda m: flock_figures.snapshots(flock_seed(m), 0.0)),
    "9": (_FLOCKS, lambda m: flock_figures.distances("min_mean_distance", m, flock_seed(m))),
    "10": (_FLOCKS, lambda m: flock_figures.distances("min_min_distance", m, flock_seed(m))),
    "edge": (
        _OFFSETS.values(),
        lambda m: flock_figures.aimed_beside({offset: m[name] for offset, name in _OFFSETS.items()}),
    ),
    "force": (_STRENGTHS, mechanism_figures.by_force),
    "anatomy": (plan.ANATOMIES, mechanism_figures.anatomy),
}
"""Measurements that a figure needs and how it is drawn, by the number in the paper. ``"edge"`` is the attack
beside the center, ``"force"`` and ``"anatomy"`` are controls of the paper's explanation."""


def draw_figures(output: Path, measured: Measured, names: Iterable[str] = FIGURES) -> list[Path]:
    """Write figures of finished measurements as PNG and SVG; return the PNG files."""
    stems = {name: output / (f"figure_{name}" if name.isdigit() else name) for name in names}
    return [save_figure(FIGURES[name][1](measured), stem) for name, stem in stems.items()]


def measure_and_draw(
    output: Path, names: Iterable[str], trials: plan.Trials, backend: Backend, *, progress: bool = False
) -> list[Path]:
    """Write some figures and return the PNG files; run only the measurements that they need.

    The cache is that of the whole study.
    """
    for name in names:
        if name not in FIGURES:
            raise InputError("figures", f"some of {', '.join(FIGURES)}", repr(name))
    known = plan.measurements(trials)
    needed = {need: known[need] for name in names for need in FIGURES[name][0]}
    output.mkdir(parents=True, exist_ok=True)
    measured = Runner(Cache(output / "cache"), backend, progress).run(needed, "Measuring")
    return draw_figures(output, measured, names)
