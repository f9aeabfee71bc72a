"""The page as one self-contained HTML file: nothing is loaded from anywhere."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from flockesc_env.common.checks import as_path
from flockesc_env.common.files import atomic_write
from flockesc_env.models.records import versions
from flockesc_env.watch.document import Run, check_runs, run_document

_SCRIPTS = (
    "data",
    "groups",
    "theme",
    "camera",
    "ground",
    "neighbors",
    "scene",
    "panel",
    "curves",
    "player",
    "live",
    "main",
)
"""Modules under ``js/``, each after those that it uses."""


def write_page(runs: Sequence[Run], path: str | Path) -> None:
    """Write a page that replays runs side by side; it opens from the file, without server or network.

    Args:
        runs: names and trajectories, at best of the same flock.
        path: the HTML file.

    Raises:
        ArgumentError: if there are no runs, they cannot be shown side by side, or the path is none.
    """
    target = as_path(path)
    page = render(runs).encode()
    with atomic_write(target) as file:
        file.write(page)


def render(runs: Sequence[Run], live: dict[str, Any] | None = None) -> str:
    """Return the page.

    Args:
        runs: names and trajectories.
        live: what the controls of a served page offer; ``None``: there are none.

    Raises:
        ArgumentError: if there are no runs, or they cannot be shown side by side.
    """
    check_runs(runs)
    document = {
        "versions": versions(),
        "live": live,
        "runs": [run_document(name, trajectory) for name, trajectory in runs],
    }
    own = files("flockesc_env.watch")
    uplot = own / "vendor" / "uplot"
    styles = [(uplot / "uPlot.min.css").read_text("utf-8"), (own / "page.css").read_text("utf-8")]
    scripts = [(uplot / "uPlot.iife.min.js").read_text("utf-8")]
    scripts += [(own / "js" / f"{name}.js").read_text("utf-8") for name in _SCRIPTS]
    return Template((own / "page.html").read_text("utf-8")).substitute(
        title=html.escape(" / ".join(name for name, _ in runs)),
        styles="\n".join(styles),
        scripts="\n".join(f"<script>\n{script}</script>" for script in scripts),
        data=_script_safe(json.dumps(document, allow_nan=False, separators=(",", ":"))),
    )


def _script_safe(document: str) -> str:
    """Keep text inside of a JSON document from ending the script element around it."""
    return document.replace("&", r"\u0026").replace("<", r"\u003c").replace(">", r"\u003e")
