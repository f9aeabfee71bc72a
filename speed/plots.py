"""Figures of a benchmark run, drawn from its records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from flockesc_env.render.palette import LIGHT
from speed.measure import PROJECT, Record
from training.figure_style import WIDTH, label_ends, save_figure

_NUMPY, _NUMBA, _JAX, _RUST, _SCIPY = LIGHT.others
# A color per library and a marker per implementation.
_STYLES = {
    PROJECT: (LIGHT.ink, "o"),
    "NumPy, all pairs": (_NUMPY, "s"),
    "NumPy, BLAS": (_NUMPY, "P"),
    "SciPy cKDTree": (_SCIPY, "^"),
    "Numba, cell list, fastmath": (_NUMBA, "D"),
    "JAX, all pairs": (_JAX, "*"),
    "JAX, all pairs, float32": (_JAX, "p"),
    "plain Rust, cell list": (_RUST, "h"),
}


def draw(records: list[Record], folder: Path) -> list[Path]:
    """Draw the cost of a step against the range, if it was measured; return the files."""
    kernel = [record for record in records if record.section == "kernel"]
    return [save_figure(_costs(kernel), folder / "cost_against_range", ("png",))] if kernel else []


def _costs(kernel: Sequence[Record]) -> Figure:
    """Draw a line per implementation, with its name right of the axes."""
    figure = Figure(figsize=(WIDTH, 5.4), layout="constrained")
    axes = figure.subplots()
    axes.grid(which="major", color=LIGHT.grid)
    axes.set(xlabel="interaction range (m)", ylabel="time per step of one flock (µs)", yscale="log")
    axes.set_title("A step of the paper's flock: 300 agents, one core")
    axes.margins(y=0.1)
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:,g}"))
    ends = []
    for name in dict.fromkeys(record.implementation for record in kernel):
        line = [(r.case["rho"], 1e6 * r.median) for r in kernel if r.implementation == name]
        color, marker = _STYLES[name]
        width, size, zorder = (3.5, 7, 3) if name == PROJECT else (1.5, 5, 2)
        axes.plot(
            *zip(*line, strict=True), color=color, marker=marker, lw=width, markersize=size, zorder=zorder
        )
        ends.append((line[-1][1], name, color))
    label_ends(axes, ends, gap=0.06)
    return figure
