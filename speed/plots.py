"""Figures of a benchmark run, drawn from its records."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from flockesc_env.render.palette import LIGHT
from speed import PROJECT
from speed.measure import Record
from training.figure_style import WIDTH, label_ends, label_points, save_figure

_NUMPY, _NUMBA, _JAX, _RUST, _SCIPY = LIGHT.others
# A color per library and a marker per contender.
_STYLES = {
    PROJECT: (LIGHT.ink, "o"),
    "NumPy, all pairs": (_NUMPY, "s"),
    "NumPy, BLAS": (_NUMPY, "P"),
    "SciPy cKDTree": (_SCIPY, "^"),
    "Numba, all pairs, fastmath": (_NUMBA, "v"),
    "Numba, cell list, fastmath": (_NUMBA, "D"),
    "JAX, all pairs": (_JAX, "*"),
    "JAX, all pairs, float32": (_JAX, "p"),
    "plain Rust, all pairs": (_RUST, "X"),
    "plain Rust, cell list": (_RUST, "h"),
}


def draw(records: list[Record], folder: Path) -> list[Path]:
    """Draw the figures that the records suffice for; return their files."""
    kernel = [record for record in records if record.section == "kernel"]
    size = [record for record in records if record.section == "size" and set(record.case) == {"n", "rho"}]
    files = []
    if kernel:
        files.append(cost_against_range(kernel, folder))
    if size:
        files.append(cost_against_size(size, folder))
    return files


def cost_against_range(records: list[Record], folder: Path) -> Path:
    """Draw the cost of a step of the paper's flock against the range; return the file."""
    figure, axes = _figure()
    _lines(axes, records, "rho", lambda record: 1e6 * record.median)
    axes.set_xlabel("interaction range (m)")
    axes.set_ylabel("time per step of one flock (µs)")
    axes.set_title("A step of the paper's flock: 300 agents, one core")
    return _save(figure, folder / "cost_against_range.png")


def cost_against_size(records: list[Record], folder: Path) -> Path:
    """Draw the cost of a step per agent against the size of the flock; return the file."""
    figure, axes = _figure()
    axes.set_xscale("log")
    _lines(axes, records, "n", lambda record: 1e9 * record.median / record.case["n"])
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
    axes.set_xlabel("number of agents")
    axes.set_ylabel("time per step and agent (ns)")
    axes.set_title("Larger flocks of the same density: range 10 m, one core")
    return _save(figure, folder / "cost_against_size.png")


def _figure() -> tuple[Figure, Axes]:
    figure = Figure(figsize=(WIDTH, 5.4), layout="constrained")
    axes = figure.subplots()
    axes.grid(which="major", color=LIGHT.grid)
    axes.set_yscale("log")
    axes.margins(y=0.1)
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:,g}"))
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _lines(axes: Axes, records: list[Record], key: str, value: Callable[[Record], float]) -> None:
    """Draw a line per contender, with its name right of the axes, or of its end if that is earlier."""
    last = max(record.case[key] for record in records if record.seconds)
    ends, early = [], []
    for name in dict.fromkeys(record.contender for record in records):
        points = [(r.case[key], value(r)) for r in records if r.contender == name and r.seconds]
        color, marker = _STYLES[name]
        is_own = name == PROJECT
        axes.plot(
            *zip(*points, strict=True),
            color=color,
            marker=marker,
            linewidth=3.5 if is_own else 1.5,
            markersize=7 if is_own else 5,
            zorder=3 if is_own else 2,
        )
        if points[-1][0] == last:
            ends.append((points[-1][1], name, color))
        else:
            early.append((points[-1], name, color))
    label_ends(axes, ends, gap=0.06)
    label_points(axes, early, gap=0.06)


def _save(figure: Figure, path: Path) -> Path:
    save_figure(figure, path.with_suffix(""), (path.suffix[1:],))
    return path
