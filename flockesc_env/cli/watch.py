"""The command ``flockesc watch``: show flocks in the browser or write a page or video."""

from __future__ import annotations

import tempfile
import webbrowser
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flockesc_env.cli.flags import EXPECTED, Progress, ScenarioFlags, optional, policy_of, switch
from flockesc_env.cli.output import Exit, check_output, note, show
from flockesc_env.cli.runs import BEST_RANGE
from flockesc_env.common.checks import as_seed
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.common.files import suffix_of, write_text
from flockesc_env.common.progress import progress_bar
from flockesc_env.models import records
from flockesc_env.models.simulate import Trajectory
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.registry import policy_file
from flockesc_env.policies.rollout import simulate
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch.live import file_document, has_engine, page_spec, scenario_documents
from flockesc_env.watch.page import Content, render, replay

_PAGE, _VIDEOS = ".html", (".mp4", ".gif")
_GROUP = "given files"
_DEFAULT = (f"fixed:{BEST_RANGE:g}", "stubborn-leaders")


def run(
    scenario: ScenarioFlags,
    policies: Annotated[
        Positional[tuple[str, ...]],
        arg(
            help=f"{EXPECTED}; or recorded runs (.npz) of a flock",
            metavar="[POLICY ..]",
            help_behavior_hint=f"(default: {' '.join(_DEFAULT)})",
        ),
    ] = (),
    *,
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
    """Watch flocks in the browser: policies on one flock, or recorded runs.

    The page plays fixed ranges, networks and simple rules; others are recorded.

    Example: flockesc watch fixed:12 stubborn-leaders --seed 242
    """
    check_output(output, [_PAGE, *_VIDEOS])
    chosen = scenario.build()
    if not isinstance(chosen, FlockScenario):
        raise InputError("scenario", "a scenario of a flock", "one of a line")
    specs = policies or _DEFAULT
    runs = {spec: _load_run(Path(spec)) for spec in specs if records.is_run(Path(spec))}
    found = [(spec, policy_of(spec)) for spec in specs if spec not in runs]

    def recorded() -> list[tuple[str, Trajectory]]:
        played = {spec: (spec, simulate(chosen, policy=policy, seed=seed)) for spec, policy in found}
        return [(runs | played)[spec] for spec in specs]

    if output is not None and suffix_of(output) in _VIDEOS:
        require("video", ["pygame", "imageio_ffmpeg"])
        from flockesc_env.render.video import write_video

        shown = recorded()
        frames = max(run.scenario.num_steps for _, run in shown) + 1
        with progress_bar("Video", frames, always=progress) as report:
            write_video(shown, output, progress=report)
        note(f"saved: {output}")
        return Exit.DONE
    if runs or not has_engine():
        if not runs:
            note(
                "This build has no engine for pages: the page replays. `make engine` builds it in a checkout."
            )
        shown = recorded()
        page = render(shown, replay(shown))
    else:
        page = _policy_page(found, seed, chosen)
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


def _policy_page(policies: list[tuple[str, BasePolicy]], seed: int, scenario: FlockScenario) -> str:
    """Return a page that simulates the policies it can, and replays the others."""
    recorded = [(spec, policy) for spec, policy in policies if page_spec(spec, policy) is None]
    runs = [(spec, simulate(scenario, policy=policy, seed=seed)) for spec, policy in recorded]
    indices = {spec: f"recording:{index}" for index, (spec, _) in enumerate(recorded)}
    shown = [page_spec(spec, policy) or indices[spec] for spec, policy in policies]
    networks = [
        file_document(path, spec, _GROUP) for spec in shown if (path := policy_file(spec)) is not None
    ]
    name, documents = scenario_documents(scenario, {"paper-flock": BEST_RANGE})
    start = {
        "scenario": name,
        "seed": str(as_seed(seed)),
        "policies": shown,
        "headline": networks[0]["spec"] if networks else None,
    }
    return render(runs, Content(scenarios=documents, policies=networks, start=start))


def _load_run(path: Path) -> tuple[str, Trajectory]:
    record = records.load_run(path)
    if not isinstance(record.trajectory, Trajectory):
        raise InputError("policies", "runs of a flock", f"a line in {path}")
    return record.name or path.stem, record.trajectory
