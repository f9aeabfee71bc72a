"""Figures of the control: objectives by escape force, and a flock at its smallest mean distance."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from flockesc_env.common.stats import FloatArray
from flockesc_env.jobs import Arrays
from flockesc_env.render.palette import LIGHT
from flockesc_env.scenario.objectives import FLOCK_OBJECTIVES
from studies.measurements import means
from studies.paper.jobs import with_parts
from studies.paper.mechanism_claims import flock_values
from studies.paper.plan import ANATOMIES, CAPTURE_RADIUS, CONTROL_GRID, NO_FORCE, PAPER, PAPER_FORCE
from studies.style import caption, curve, letter, subplots
from training.figure_style import RANGES, label_ends

_TICKS = (0, 2, 5, 10, 20, 50, 100)
_FORCES = {NO_FORCE: LIGHT.accent, 1.0: LIGHT.alone, PAPER_FORCE: LIGHT.fixed, 100.0: to_hex(RANGES(0.95))}


def by_force(results: Mapping[str, Arrays]) -> Figure:
    """Draw the three objectives against the range, one curve per escape force."""
    figure, panels = subplots(3.3, 1, len(FLOCK_OBJECTIVES))
    for index, (axes, spec) in enumerate(zip(panels, FLOCK_OBJECTIVES.values(), strict=True)):
        rows = []
        for strength, color in _FORCES.items():
            values = (1 if spec.unit else 100) * flock_values(results, PAPER, strength, spec)
            rows.append((f"s = {strength:g}", values, color, "-" if strength == PAPER_FORCE else "--"))
        _draw(axes, rows)
        letter(axes, index, f"{spec.symbol} ({spec.unit or '%'})")
    caption(
        figure,
        "Escape force s (0: nobody flees; 10: the paper's)."
        f" Survival: agents within {CAPTURE_RADIUS:g} m of the predator are caught",
    )
    return figure


def anatomy(results: Mapping[str, Arrays]) -> Figure:
    """Draw where flocks are at their smallest mean distance, and what makes it."""
    still, fleeing, frozen = (with_parts(results[name]) for name in ANATOMIES)
    ink, fixed, alone, accent = LIGHT.ink, LIGHT.fixed, LIGHT.alone, LIGHT.accent
    curves: dict[str, list[tuple[str, FloatArray, str, str]]] = {
        "center to predator, and spread (m)": [
            ("center", still["center"], fixed, "-"),
            ("spread", still["dispersion"], accent, "-"),
            ("center, s = 10", fleeing["center"], fixed, ":"),
            ("spread, s = 10", fleeing["dispersion"], accent, ":"),
        ],
        "headings and flights (no unit)": [
            ("polarization", still["polarization"], fixed, "-"),
            ("straightness", still["straightness"], alone, "-"),
            ("outwardness", still["outwardness"], accent, "-"),
            ("the same,\nfrozen graph", frozen["outwardness"], accent, ":"),
        ],
        "J_mean minus that at 0 m, and its parts (m)": [
            ("sorting", still["sorting"], accent, "-"),
            ("turning", still["turning"], alone, "-"),
            ("agreement", still["agreement"], fixed, "-"),
            ("sum", still["gain"], ink, "-"),
        ],
        "J_mean and its controls (m)": [
            ("measured", still["mean_distance"], ink, "-"),
            ("aligned only", still["aligned"], fixed, "-"),
            ("stop after 1 s", still["stopped_1"], alone, "-"),
            ("frozen graph", frozen["mean_distance"], accent, ":"),
        ],
    }
    figure, panels = subplots(6.2, 2, 2)
    for index, (axes, (title, rows)) in enumerate(zip(panels.flat, curves.items(), strict=True)):
        _draw(axes, rows, gap=0.11)
        letter(axes, index, title)
    panels[1, 0].axhline(0, color=LIGHT.muted, lw=0.8)
    caption(
        figure,
        "Flocks that do not flee (s = 0) at their smallest mean distance, 95 % intervals; dotted: as labeled",
    )
    return figure


def _draw(axes: Axes, rows: list[tuple[str, FloatArray, str, str]], gap: float = 0.075) -> None:
    """Draw named curves over the ranges; the square root of the axis keeps short ranges apart."""
    for _, values, color, style in rows:
        curve(axes, CONTROL_GRID, means(values), color, style, band=0.2, lw=1.6)
    axes.set_xscale("function", functions=(lambda x: np.sqrt(np.maximum(x, 0)), np.square))
    axes.set_xticks(_TICKS, [str(tick) for tick in _TICKS])
    axes.set(xlabel="interaction range (m)", xlim=(0, CONTROL_GRID[-1]))
    label_ends(axes, [(float(values[-1].mean()), name, color) for name, values, color, _ in rows], gap)
