"""The page: flocks in the browser, as one HTML file that loads nothing else."""

import html
import json
import zlib
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flockesc_env.common.checks import as_path
from flockesc_env.common.files import write_text
from flockesc_env.models.order import unit
from flockesc_env.models.records import versions
from flockesc_env.models.simulate import Trajectory, as_runs
from flockesc_env.render.frames import policy_kind, policy_title
from flockesc_env.render.palette import DARK, LIGHT
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.live import ENGINE, has_engine, safe_json, scenario_documents, start_document

_REPLAY = ("dom", "data", "theme", "camera", "ground", "plot", "scene", "panel", "curves", "player", "page")
_FLIGHTS = ("npz", "steer", "engine", "flight", "policies")
_TOOLS = ("answer", "choice", "inspect", "address", "python")
_LIVE = (*_FLIGHTS, *_TOOLS, "live_page", "controls")
"""Scripts under ``js/``, in order of dependence: of all pages, and of pages that simulate."""

Run = tuple[str, Trajectory]
"""A name and a run."""

_OBJECTIVE = FlockScenario.objectives["min_mean_distance"]
"""The objective that the page shows. A recorded run does not say what its policy maximizes."""

_LEAD = "How far each agent listens decides whether the flock escapes. Change the range, and see a whole run."


@dataclass(frozen=True, kw_only=True)
class Content:
    """What a page shows, besides recorded runs. Without scenarios, it only replays them.

    ``start`` is the flock and the policies at first: ``{"scenario": .., "seed": .., "policies": [..]}``, and
    as ``"headline"`` the learned policy of the answer or None.
    """

    scenarios: Sequence[dict[str, Any]] = ()  # see `live.scenario_document`
    policies: Sequence[dict[str, Any]] = ()  # see `live.file_document`
    start: Mapping[str, Any]
    playground: Mapping[str, Any] | None = None  # means over many flocks
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
            compare best; all are in the plane or all in space.
        path: the HTML file.
    """
    target = as_path(path)
    shown = [(target.stem, runs)] if isinstance(runs, Trajectory) else runs
    write_text(target, render(shown, replay(shown)))


def replay(runs: Sequence[Run]) -> Content:
    """Return the content of a page that shows recorded runs at first, after ``as_runs``."""
    as_runs(runs)
    first = runs[0][1]
    name, documents = scenario_documents(first.scenario, {})
    start = start_document(first)
    if start is not None:
        documents = [{**each, "start": start} if each["name"] == name else each for each in documents]
    specs = [f"recording:{index}" for index in range(len(runs))]
    seed = None if start else str(first.seed)
    shown = {"scenario": name, "seed": seed, "policies": specs, "headline": None}
    return Content(scenarios=documents, start=shown)


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
    scripts, engine = [], ""  # engine: the element that holds the core in WebAssembly
    if is_live:
        scripts.append((ENGINE / "flockesc_wasm.js").read_text("utf-8"))
        packed = b64encode(zlib.compress((ENGINE / "flockesc_wasm_bg.wasm").read_bytes(), 9))
        engine = f'<script type="application/octet-stream" id="engine">{packed.decode()}</script>'
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
        styles=f"{theme()}\n{(here / 'page.css').read_text('utf-8')}",
        engine=engine,
        scripts="\n".join(f"<script>\n{script}</script>" for script in scripts),
        data=safe_json(document),
    )


def theme() -> str:
    """Return the CSS that names the palette's colors, for a light and a dark page."""
    light, dark = (
        " ".join(
            [
                *(f"--{name}: {color};" for name, color in asdict(palette).items() if isinstance(color, str)),
                *(f"--other-{index}: {color};" for index, color in enumerate(palette.others)),
                f"--ranges: {', '.join(palette.ranges)};",
            ]
        )
        for palette in (LIGHT, DARK)
    )
    return f":root {{ {light} }}\n@media (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}"


def run_document(name: str, trajectory: Trajectory) -> dict[str, Any]:
    """Return the document of a run of T steps, for ``json.dumps``; columns are compressed arrays in base64.

    ``title`` is the readable name. Columns have an entry per time, 0..T. ``ranges`` are those of the step
    that begins at a time; their last entry is that of the step that ends at T.
    """
    in_force = np.minimum(trajectory.interaction_ranges, np.finfo(np.float32).max)  # as the columns hold it
    ranges = np.concatenate([in_force, in_force[-1:]])
    columns = {
        "times": _column(trajectory.times),
        "positions": _column(trajectory.positions),
        "headings": _column(np.rint(127 * unit(trajectory.velocities)), "|i1"),  # signed bytes
        "ranges": _column(ranges),
        "predators": _column(trajectory.predator_positions),
        "meanDistance": _column(trajectory.mean_distance),
        "lowestMean": _column(np.minimum.accumulate(getattr(trajectory, _OBJECTIVE.series))),
        "survivors": _column(np.rint(trajectory.fraction_surviving * trajectory.scenario.num_agents), "<u4"),
        # An agent that is never caught gets a step that never comes.
        "caughtAt": _column(np.where(trajectory.caught_at < 0, 2**32 - 1, trajectory.caught_at), "<u4"),
    }
    return {
        "name": name,
        "title": policy_title(name, trajectory.scenario.range_unit),
        "kind": policy_kind(name, trajectory),
        # None if no seed gives this start. A string, because 64 bits do not fit into a number of JavaScript.
        "seed": None if trajectory.is_start_given else str(trajectory.seed),
        "scenario": json.loads(trajectory.scenario.to_json()),
        "rangeUnit": trajectory.scenario.range_unit,
        "columns": columns,
    }


def _column(values: NDArray[Any], dtype: str = "<f4") -> dict[str, Any]:
    packed = np.ascontiguousarray(values, dtype=dtype)
    data = b64encode(zlib.compress(packed.tobytes())).decode()
    return {"dtype": packed.dtype.name, "shape": packed.shape, "data": data}
