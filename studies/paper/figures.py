"""The figures of the paper by number, and the measurements that each of them needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from flockesc_env.common.errors import ArgumentError
from flockesc_env.jobs import Arrays, Backend, Cache
from studies.measurements import Runner
from studies.paper import flock_figures, line_figures, mechanism_figures
from studies.paper.plan import (
    ANATOMIES,
    FORCES,
    OFFSETS,
    PAPER_WORLD,
    STRENGTHS,
    Trials,
    captures,
    control,
    measurements,
)
from studies.paper.realizations import flock_seed, line_seed
from training.figure_style import save_figure

Measured = Mapping[str, Arrays]


@dataclass(frozen=True)
class PaperFigure:
    """A figure: the stem of its files, the names of its measurements, and how it is drawn from them."""

    stem: str
    needs: tuple[str, ...]
    draw: Callable[[Measured], Figure]


_GRID = ("curves", "grid flock")


def _line(measured: Measured) -> int:
    return line_seed(measured["free line"])


def _flock(measured: Measured) -> int:
    return flock_seed(measured["curves"], measured["grid flock"])


def _distances(objective: str, measured: Measured) -> Figure:
    return flock_figures.distances(objective, measured["curves"], measured["grid flock"], _flock(measured))


_LINES = ("free line",)

FIGURES: Final[dict[str, PaperFigure]] = {
    "2": PaperFigure("figure_2", (), lambda _: line_figures.escape_forces()),
    "3": PaperFigure("figure_3", _LINES, lambda m: line_figures.lines_over_time(_line(m), is_attacked=False)),
    "4": PaperFigure("figure_4", _LINES, lambda m: line_figures.lines_over_time(_line(m), is_attacked=True)),
    "5": PaperFigure(
        "figure_5",
        tuple(f"grid {force}" for force in FORCES),
        lambda m: line_figures.distance_against_range({force: m[f"grid {force}"] for force in FORCES}),
    ),
    "6": PaperFigure("figure_6", _GRID, lambda m: flock_figures.snapshots(_flock(m), 100.0)),
    "7": PaperFigure("figure_7", _GRID, lambda m: flock_figures.snapshots(_flock(m), 10.0)),
    "8": PaperFigure("figure_8", _GRID, lambda m: flock_figures.snapshots(_flock(m), 0.0)),
    "9": PaperFigure("figure_9", _GRID, lambda m: _distances("mean", m)),
    "10": PaperFigure("figure_10", _GRID, lambda m: _distances("minimum", m)),
    "edge": PaperFigure(
        "edge",
        tuple(f"aimed {offset:g}" for offset in OFFSETS),
        lambda m: flock_figures.aimed_beside({offset: m[f"aimed {offset:g}"] for offset in OFFSETS}),
    ),
    "force": PaperFigure(
        "force",
        tuple(name(PAPER_WORLD, strength) for name in (control, captures) for strength in STRENGTHS),
        mechanism_figures.by_force,
    ),
    "anatomy": PaperFigure("anatomy", tuple(ANATOMIES), mechanism_figures.anatomy),
}
"""By the number in the paper; ``"edge"`` is the attack beside the center. ``"force"`` and ``"anatomy"`` are
controls of the paper's explanation."""


def draw_figures(output: Path, measured: Measured, names: Iterable[str] = FIGURES) -> None:
    """Write figures of finished measurements, as PNG and SVG."""
    for name in names:
        save_figure(FIGURES[name].draw(measured), output / FIGURES[name].stem)


def measure_and_draw(
    output: Path, names: Iterable[str], trials: Trials, backend: Backend, *, progress: bool = False
) -> list[Path]:
    """Write some figures and return the PNG files; run only the measurements that they need.

    The cache is that of the whole study.
    """
    chosen = list(dict.fromkeys(names))
    for name in chosen:
        if name not in FIGURES:
            raise ArgumentError("figures", f"some of {', '.join(FIGURES)}", repr(name))
    plan = measurements(trials)
    needed = {need: plan[need] for name in chosen for need in FIGURES[name].needs}
    output.mkdir(parents=True, exist_ok=True)
    draw_figures(output, Runner(Cache(output / "cache"), backend, progress).measure(needed), chosen)
    return [output / f"{FIGURES[name].stem}.png" for name in chosen]
