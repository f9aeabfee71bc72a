"""The watch page as one HTML file that loads nothing else."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from flockesc_env.common.checks import as_path
from flockesc_env.common.files import write_text
from flockesc_env.models.records import versions
from flockesc_env.models.simulate import Trajectory
from flockesc_env.render.palette import DARK, LIGHT
from flockesc_env.watch.document import Run, check_runs, run_document

_SCRIPTS = (
    *("data", "groups", "theme", "camera", "ground", "neighbors", "scene", "panel", "curves"),
    *("player", "live", "save", "main"),
)
"""Scripts under ``js/``, in order of dependence."""


def write_page(runs: Trajectory | Sequence[Run], path: str | Path) -> None:
    """Write a page that replays runs side by side. It opens from the file, without a server or a network.

    Args:
        runs: one run, shown under the name of the file, or a list of names and runs. Runs of the same flock
            compare best.
        path: the HTML file.

    Raises:
        ArgumentError: if there are no runs, they cannot be shown side by side, or ``path`` is not a path.
    """
    target = as_path(path)
    write_text(target, render([(target.stem, runs)] if isinstance(runs, Trajectory) else runs))


def render(runs: Sequence[Run], live: dict[str, Any] | None = None) -> str:
    """Return the page.

    Args:
        runs: names and runs.
        live: what the controls of a served page offer; ``None`` leaves the controls out.

    Raises:
        ArgumentError: if there are no runs, or they cannot be shown side by side.
    """
    check_runs(runs)
    documents = [run_document(name, trajectory) for name, trajectory in runs]
    document = {"versions": versions(), "live": live, "runs": documents}
    here = files("flockesc_env.watch")
    uplot = here / "vendor" / "uplot"
    styles = [theme(), (uplot / "uPlot.min.css").read_text("utf-8"), (here / "page.css").read_text("utf-8")]
    scripts = [(uplot / "uPlot.iife.min.js").read_text("utf-8")]
    scripts += [(here / "js" / f"{name}.js").read_text("utf-8") for name in _SCRIPTS]
    return Template((here / "page.html").read_text("utf-8")).substitute(
        title=html.escape(" / ".join(run["title"] for run in documents)),
        styles="\n".join(styles),
        scripts="\n".join(f"<script>\n{script}</script>" for script in scripts),
        data=_script_safe(json.dumps(document, allow_nan=False, separators=(",", ":"))),
    )


def theme() -> str:
    """Return the CSS that names the palette's colors, for a light and a dark page."""
    light, dark = (
        " ".join(
            f"--{name}: {color if isinstance(color, str) else ', '.join(color)};"
            for name, color in asdict(palette).items()
        )
        for palette in (LIGHT, DARK)
    )
    return f":root {{ {light} }}\n@media (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}"


def _script_safe(document: str) -> str:
    """Escape what could end the script element around a JSON document."""
    return document.replace("&", r"\u0026").replace("<", r"\u003c").replace(">", r"\u003e")
