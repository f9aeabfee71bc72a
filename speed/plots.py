"""Figures of a benchmark run, drawn from its records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from flockesc_env.render.palette import LIGHT
from speed.measure import PROJECT, Record
from training.figure_style import WIDTH, label_ends, label_points, save_figure

_NUMPY, _NUMBA, _JAX, _RUST, _SCIPY = LIGHT.others
# A color per library and a marker per implementation.
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
    figures = {}
    if kernel:
        figures["cost_against_range"] = _costs(
            [(record, record.case["rho"], 1e6 * record.median) for record in kernel],
            ("interaction range (m)", "time per step of one flock (µs)"),
            "A step of the paper's flock: 300 agents, one core",
        )
    if size:
        figures["cost_against_size"] = _costs(
            [(record, record.case["n"], 1e9 * record.median / record.case["n"]) for record in size],
            ("number of agents", "time per step and agent (ns)"),
            "Larger flocks of the same density: range 10 m, one core",
            xscale="log",
        )
    return [save_figure(figure, folder / name, ("png",)) for name, figure in figures.items()]


def _costs(
    points: Sequence[tuple[Record, float, float]], labels: tuple[str, str], title: str, xscale: str = "linear"
) -> Figure:
    """Draw a line per implementation, with its name right of the axes, or of its end if that is earlier."""
    figure = Figure(figsize=(WIDTH, 5.4), layout="constrained")
    axes = figure.subplots()
    axes.grid(which="major", color=LIGHT.grid)
    axes.set(xlabel=labels[0], ylabel=labels[1], title=title, xscale=xscale, yscale="log")
    axes.margins(y=0.1)
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:,g}"))
    last = max(x for _, x, _ in points)
    ends, early = [], []
    for name in dict.fromkeys(record.implementation for record, _, _ in points):
        line = [(x, y) for record, x, y in points if record.implementation == name]
        color, marker = _STYLES[name]
        width, size, zorder = (3.5, 7, 3) if name == PROJECT else (1.5, 5, 2)
        axes.plot(
            *zip(*line, strict=True), color=color, marker=marker, lw=width, markersize=size, zorder=zorder
        )
        x, y = line[-1]
        if x == last:
            ends.append((y, name, color))
        else:
            early.append(((x, y), name, color))
    label_ends(axes, ends, gap=0.06)
    label_points(axes, early, gap=0.06)
    return figure
