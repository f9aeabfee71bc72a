"""The page: flocks in the browser, as one HTML file that loads nothing else."""

from __future__ import annotations

import html
import zlib
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
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
from flockesc_env.watch.live import ENGINE, has_engine, safe_json, scenario_documents, start_document

_REPLAY = ("dom", "data", "theme", "camera", "ground", "scene", "panel", "curves", "player", "page")
_LIVE = (
    *("npz", "steer", "engine", "flight", "policies", "choice", "inspect", "predict", "address", "python"),
    *("live_page", "controls"),
)
"""Scripts under ``js/``, in order of dependence: of all pages, and of pages that simulate."""

_LEAD = "How far each agent listens decides whether the flock escapes. Change the range, and see a whole run."


@dataclass(frozen=True, kw_only=True)
class Content:
    """What a page shows, besides recorded runs. Without scenarios, it only replays them.

    ``start`` is the flock and the policies at first: ``{"scenario": .., "seed": .., "policies": [..]}``, and
    as ``"headline"`` the policy behind the button "Learned".
    """

    scenarios: Sequence[dict[str, Any]] = ()  # see `live.scenario_document`
    policies: Sequence[dict[str, Any]] = ()  # see `live.file_document`
    start: Mapping[str, Any]
    playground: Mapping[str, Any] | None = None  # means over many flocks, and seeds of the tour
    heading: str = "Flock under attack"
    lead: str = _LEAD  # sentences below the heading
    head: str = ""  # HTML of metadata
    film: str = ""  # HTML that browsers without WebAssembly show
    footer: str = ""  # HTML of links


def write_page(runs: Trajectory | Sequence[Run], path: str | Path) -> None:
    """Write a page that replays runs side by side. It opens from the file, without a server or a network.

    A reader can also change the range and play the flock again, if the package contains the core in
    WebAssembly.

    Args:
        runs: one run, shown under the name of the file, or a list of names and runs. Runs of the same flock
            compare best.
        path: the HTML file.

    Raises:
        InputError: if there are no runs, they cannot be shown side by side, or ``path`` is not a path.
    """
    target = as_path(path)
    shown = [(target.stem, runs)] if isinstance(runs, Trajectory) else runs
    write_text(target, render(shown, replay(shown)))


def replay(runs: Sequence[Run], policies: Sequence[dict[str, Any]] = ()) -> Content:
    """Return the content of a page that shows recorded runs at first, after ``check_runs``."""
    check_runs(runs)
    first = runs[0][1]
    name, documents = scenario_documents(first.scenario, {})
    start = start_document(first)
    if start is not None:
        documents = [{**each, "start": start} if each["name"] == name else each for each in documents]
    specs = [f"recording:{index}" for index in range(len(runs))]
    seed = None if start else str(first.seed)
    shown = {"scenario": name, "seed": seed, "policies": specs, "headline": None}
    return Content(scenarios=documents, policies=policies, start=shown)


def render(runs: Sequence[Run], content: Content, *, with_engine: bool = True) -> str:
    """Return the page; ``with_engine``: with the core in WebAssembly (0.5 MB), if the package has it."""
    is_live = with_engine and has_engine() and bool(content.scenarios)
    recordings = [run_document(name, trajectory) for name, trajectory in runs]
    document = {
        "versions": versions(),
        "scenarios": content.scenarios if is_live else [],
        "policies": content.policies if is_live else [],
        "start": content.start,
        "playground": content.playground,
        "recordings": recordings,
    }
    here = files("flockesc_env.watch")
    uplot = here / "vendor" / "uplot"
    styles = [theme(), (uplot / "uPlot.min.css").read_text("utf-8"), (here / "page.css").read_text("utf-8")]
    scripts = [(uplot / "uPlot.iife.min.js").read_text("utf-8")]
    if is_live:
        scripts.append((ENGINE / "flockesc_wasm.js").read_text("utf-8"))
    names = (*_REPLAY, *(_LIVE if is_live else ()), "start")
    scripts += [(here / "js" / f"{name}.js").read_text("utf-8") for name in names]
    titles = [run["title"] for run in recordings]
    return Template((here / "page.html").read_text("utf-8")).substitute(
        title=html.escape(" / ".join(titles) or content.heading),
        heading=html.escape(content.heading),
        lead=html.escape(content.lead if is_live else ""),
        head=content.head,
        film=content.film,
        footer=content.footer,
        styles="\n".join(styles),
        engine=_engine() if is_live else "",
        scripts="\n".join(f"<script>\n{script}</script>" for script in scripts),
        data=safe_json(document),
    )


def _engine() -> str:
    """Return the element that holds the core in WebAssembly."""
    packed = zlib.compress((ENGINE / "flockesc_wasm_bg.wasm").read_bytes(), 9)
    return f'<script type="application/octet-stream" id="engine">{b64encode(packed).decode()}</script>'


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
