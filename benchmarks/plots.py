"""Figures of one run, drawn from its records alone. Matplotlib, no display."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from benchmarks import PROJECT
from benchmarks.measure import Record

_DPI = 150
# Okabe and Ito's palette, which color-blind people can tell apart; markers tell once more.
_STYLES = {
    PROJECT: ("#D55E00", "o"),
    "NumPy, all pairs": ("#999999", "s"),
    "NumPy, BLAS": ("#000000", "P"),
    "SciPy cKDTree": ("#E69F00", "^"),
    "Numba, cell list": ("#56B4E9", "v"),
    "Numba, cell list, fastmath": ("#0072B2", "D"),
    "JAX, all pairs": ("#CC79A7", "*"),
    "plain Rust, all pairs": ("#A89F00", "X"),
    "plain Rust, cell list": ("#009E73", "h"),
}


def draw(records: list[Record], folder: Path) -> list[Path]:
    """Draw the figures whose records there are; return their files."""
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
    axes.set_ylabel("µs per step of one flock")
    axes.set_title("A step of the paper's flock: 300 agents, one core, float64")
    return _save(figure, folder / "cost_against_range.png")


def cost_against_size(records: list[Record], folder: Path) -> Path:
    """Draw the cost of a step per agent against the size of the flock; return the file."""
    figure, axes = _figure()
    _lines(axes, records, "n", lambda record: 1e9 * record.median / record.case["n"])
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
    axes.set_xlabel("agents")
    axes.set_ylabel("ns per step and agent")
    axes.set_title("Larger flocks of the same density: range 10 m, one core, float64")
    return _save(figure, folder / "cost_against_size.png")


def _figure() -> tuple[Figure, Axes]:
    figure = Figure(figsize=(9, 4.8), layout="constrained")
    axes = figure.subplots()
    axes.grid(which="major", color="0.9")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:,g}"))
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _lines(axes: Axes, records: list[Record], key: str, value: Callable[[Record], float]) -> None:
    """Draw a line per contender, and a legend in the order of the lines' right ends."""
    ends = {}
    for name in dict.fromkeys(record.contender for record in records):
        points = [(r.case[key], value(r)) for r in records if r.contender == name and r.seconds]
        color, marker = _STYLES[name]
        is_own = name == PROJECT
        (line,) = axes.plot(
            *zip(*points, strict=True),
            color=color,
            marker=marker,
            label=name,
            linewidth=3.5 if is_own else 1.5,
            markersize=8 if is_own else 6,
            zorder=3 if is_own else 2,
        )
        ends[line] = points[-1][1]
    order = sorted(ends, key=lambda line: -ends[line])
    legend = axes.legend(handles=order, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    for text in legend.get_texts():
        if text.get_text() == PROJECT:
            text.set_fontweight("bold")


def _save(figure: Figure, path: Path) -> Path:
    figure.savefig(path, dpi=_DPI)
    return path
