"""The command ``flockesc watch``: show flocks in the browser or write a page or video."""

from __future__ import annotations

import tempfile
import webbrowser
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Progress, ScenarioFlags, optional, switch
from flockesc_env.cli.output import check_output, note, show
from flockesc_env.cli.policies import EXPECTED, policy_of
from flockesc_env.cli.simulate import BEST_RANGE
from flockesc_env.common.checks import as_seed
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.common.files import suffix_of, write_text
from flockesc_env.common.progress import progress_bar
from flockesc_env.models import records
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.files import SUFFIX
from flockesc_env.policies.registry import NamedPolicy
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.live import file_document, has_engine, page_spec, scenario_documents
from flockesc_env.watch.page import Content, render, replay

_Runs = list[tuple[str, Trajectory]]
_Policies = list[tuple[str, NamedPolicy]]
_PAGE, _VIDEOS = ".html", (".mp4", ".gif")
_GROUP = "given files"


def run(
    files: Annotated[
        Positional[tuple[Path, ...]],
        arg(
            help="recorded runs (.npz) of a flock, shown side by side",
            metavar="[FILE ..]",
            help_behavior_hint="(default: run the policies)",
        ),
    ],
    scenario: ScenarioFlags,
    *,
    policies: Annotated[
        tuple[str, ...], arg(help=f"policies to run if no recorded runs are given: {EXPECTED}")
    ] = (f"fixed:{BEST_RANGE:g}", "stubborn-leaders"),
    seed: Annotated[int, arg(help="seed of the flock")] = 242,
    output: Annotated[
        Path | None,
        *optional(
            "write a page (.html) or a video (.mp4, .gif; needs the video extra)",
            "write a page to a temporary file, and open it",
        ),
    ] = None,
    no_browser: Annotated[bool, switch("print the path of the page without opening a browser")] = False,
    progress: Progress = False,
) -> Exit:
    """Watch flocks in the browser: recorded runs, or policies on one flock.

    The page plays fixed ranges, networks and simple rules; others are recorded.

    Example: flockesc watch --policies fixed:12 stubborn-leaders --seed 242
    """
    check_output(output, [_PAGE, *_VIDEOS])
    chosen = scenario.build()
    if not isinstance(chosen, FlockScenario):
        raise InputError("scenario", "a scenario of a flock", "one of a line")
    found = [] if files else [(spec, policy_of(spec)) for spec in policies]
    if not files and not found:
        raise InputError("policies", "at least one", "none")
    if output is not None and suffix_of(output) in _VIDEOS:
        _write_video(_load_runs(files) or _record(found, seed, chosen), output, always=progress)
        note(f"saved: {output}")
        return Exit.DONE
    runs = _load_runs(files)
    page = render(runs, replay(runs)) if files else _policy_page(found, seed, chosen)
    if output is not None:
        write_text(output, page)
        note(f"saved: {output}")
        return Exit.DONE
    path = Path(tempfile.mkdtemp(prefix="flockesc-")) / f"flock{_PAGE}"
    write_text(path, page)
    show(f"The page is {path}")
    if not no_browser:
        webbrowser.open(path.as_uri())
    return Exit.DONE


def _policy_page(policies: _Policies, seed: int, scenario: FlockScenario) -> str:
    """Return a page that simulates the policies it can, and replays the others."""
    if not has_engine():
        note("This build has no engine for pages: the page replays. `make engine` builds it in a checkout.")
        runs = _record(policies, seed, scenario)
        return render(runs, replay(runs))
    recorded = [(spec, policy) for spec, policy in policies if page_spec(spec, policy) is None]
    runs = _record(recorded, seed, scenario)
    indices = {spec: f"recording:{index}" for index, (spec, _) in enumerate(recorded)}
    shown = [page_spec(spec, policy) or indices[spec] for spec, policy in policies]
    networks = [file_document(Path(spec), spec, _GROUP) for spec in shown if suffix_of(spec) == SUFFIX]
    name, documents = scenario_documents(scenario, {"paper-flock": BEST_RANGE})
    start = {
        "scenario": name,
        "seed": str(as_seed(seed)),
        "policies": shown,
        "headline": networks[0]["spec"] if networks else None,
    }
    return render(runs, Content(scenarios=documents, policies=networks, start=start))


def _record(policies: _Policies, seed: int, scenario: FlockScenario) -> _Runs:
    return [(spec, policy.record(seed, scenario)) for spec, policy in policies]


def _load_runs(files: tuple[Path, ...]) -> _Runs:
    runs = []
    for path in files:
        record = records.load_run(path)
        run = record.trajectory
        if not isinstance(run, Trajectory):
            raise InputError("files", "runs of a flock", f"a line in {path}")
        runs.append((record.name or path.stem, run))
    return runs


def _write_video(runs: _Runs, path: Path, *, always: bool) -> None:
    require("video", ["pygame", "imageio_ffmpeg"])
    from flockesc_env.render.video import write_video

    frames = max(run.scenario.num_steps for _, run in runs) + 1
    with progress_bar("Video", frames, always=always) as report:
        write_video(runs, path, progress=report)
