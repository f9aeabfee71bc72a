"""Figures of the control: objectives by escape force, and a flock at its smallest mean distance."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.objectives import FLOCK_OBJECTIVES
from flockesc_env.jobs import Arrays
from flockesc_env.render.palette import LIGHT
from studies.measurements import means
from studies.paper.jobs import with_parts
from studies.paper.mechanism_claims import flock_values
from studies.paper.plan import CAPTURE_RADIUS, CONTROL_GRID, NO_FORCE, PAPER, PAPER_FORCE, STRENGTHS
from studies.style import caption, curve, letter, subplots
from training.figure_style import RANGES, label_ends

_TICKS = (0, 2, 5, 10, 20, 50, 100)
_FORCES = {NO_FORCE: LIGHT.accent, 1.0: LIGHT.alone, PAPER_FORCE: LIGHT.fixed, 100.0: to_hex(RANGES(0.95))}


def by_force(results: Mapping[str, Arrays]) -> Figure:
    """Draw the three objectives against the range, one curve per escape force."""
    figure, panels = subplots(3.3, 1, len(FLOCK_OBJECTIVES))
    for index, (axes, spec) in enumerate(zip(panels, FLOCK_OBJECTIVES.values(), strict=True)):
        ends = []
        for strength in STRENGTHS:
            rows = (1 if spec.unit else 100) * flock_values(results, PAPER, strength, spec)
            _curve(axes, rows, _FORCES[strength], "-" if strength == PAPER_FORCE else "--")
            ends.append((float(rows[-1].mean()), f"s = {strength:g}", _FORCES[strength]))
        letter(axes, index, f"{spec.symbol} ({spec.unit or '%'})")
        _ranges(axes)
        label_ends(axes, ends)
    caption(
        figure,
        "Escape force s (0: nobody flees; 10: the paper's)."
        f" Survival: agents within {CAPTURE_RADIUS:g} m of the predator are caught",
    )
    return figure


def anatomy(results: Mapping[str, Arrays]) -> Figure:
    """Draw where flocks are at their smallest mean distance, and what makes it."""
    names = ("anatomy", "anatomy fleeing", "anatomy frozen")
    still, fleeing, frozen = (with_parts(results[name]) for name in names)
    ink, fixed, alone, accent = LIGHT.ink, LIGHT.fixed, LIGHT.alone, LIGHT.accent
    curves: dict[str, list[tuple[FloatArray, str, str, str]]] = {
        "center to predator, and spread (m)": [
            (still["center"], "center", fixed, "-"),
            (still["dispersion"], "spread", accent, "-"),
            (fleeing["center"], "center, s = 10", fixed, ":"),
            (fleeing["dispersion"], "spread, s = 10", accent, ":"),
        ],
        "headings and flights (no unit)": [
            (still["polarization"], "polarization", fixed, "-"),
            (still["straightness"], "straightness", alone, "-"),
            (still["outwardness"], "outwardness", accent, "-"),
            (frozen["outwardness"], "the same,\nfrozen graph", accent, ":"),
        ],
        "J_mean minus that at 0 m, and its parts (m)": [
            (still["sorting"], "sorting", accent, "-"),
            (still["turning"], "turning", alone, "-"),
            (still["agreement"], "agreement", fixed, "-"),
            (still["gain"], "sum", ink, "-"),
        ],
        "J_mean and its controls (m)": [
            (still["mean_distance"], "measured", ink, "-"),
            (still["aligned"], "aligned only", fixed, "-"),
            (still["stopped_1"], "stop after 1 s", alone, "-"),
            (frozen["mean_distance"], "frozen graph", accent, ":"),
        ],
    }
    figure, panels = subplots(6.2, 2, 2)
    for index, (axes, (title, rows)) in enumerate(zip(panels.flat, curves.items(), strict=True)):
        for values, _, color, style in rows:
            _curve(axes, values, color, style)
        letter(axes, index, title)
        _ranges(axes)
        ends = [(float(values[-1].mean()), label, color) for values, label, color, _ in rows]
        label_ends(axes, ends, gap=0.11)
    panels[1, 0].axhline(0, color=LIGHT.muted, lw=0.8)
    caption(
        figure,
        "Flocks that do not flee (s = 0) at their smallest mean distance, 95 % intervals; dotted: as labeled",
    )
    return figure


def _curve(axes: Axes, values: FloatArray, color: str, style: str) -> None:
    curve(axes, CONTROL_GRID, means(values), color, style, band=0.2, lw=1.6)


def _ranges(axes: Axes) -> None:
    """Scale the axis of ranges by the square root, which keeps short ranges apart."""
    axes.set_xscale("function", functions=(lambda x: np.sqrt(np.maximum(x, 0)), np.square))
    axes.set_xticks(_TICKS, [str(tick) for tick in _TICKS])
    axes.set(xlabel="interaction range (m)", xlim=(0, CONTROL_GRID[-1]))
