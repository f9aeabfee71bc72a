"""The command ``flockesc watch``: show flocks in the browser or write a page or video."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Progress, ScenarioFlags, optional, switch
from flockesc_env.cli.output import check_output, note
from flockesc_env.cli.policies import EXPECTED, policy_of
from flockesc_env.common.errors import ArgumentError
from flockesc_env.common.extras import require
from flockesc_env.common.progress import progress_bar
from flockesc_env.models import records
from flockesc_env.models.simulate import Trajectory
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.watch import serve, write_page

_Runs = list[tuple[str, Trajectory]]
_PAGE, _VIDEOS = ".html", (".mp4", ".gif")


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
        tuple[str, ...],
        arg(help=f"policies to run if no recorded runs are given: {EXPECTED}"),
    ] = ("fixed:15", "stubborn-leaders"),
    seed: Annotated[int, arg(help="seed of the flock")] = 0,
    output: Annotated[
        Path | None,
        *optional(
            "write a page (.html) or a video (.mp4, .gif; needs the video extra) instead of serving the page",
            "serve the page on this machine",
        ),
    ] = None,
    port: Annotated[int, arg(help="port of the server; 0: any free port")] = 0,
    no_browser: Annotated[bool, switch("print the address of the page without opening a browser")] = False,
    progress: Progress = False,
) -> Exit:
    """Watch flocks in the browser: recorded runs, or policies on one flock.

    The range slider of the page simulates the flock again. Ctrl-C stops the server.

    Example: flockesc watch --policies fixed:10 stubborn-leaders --seed 7
    """
    check_output(output, [_PAGE, *_VIDEOS])
    chosen = scenario.build()
    if not isinstance(chosen, FlockScenario):
        raise ArgumentError("scenario", "a scenario of a flock", "one of a line")
    runs = _load_runs(files) if files else _run_policies(policies, seed, chosen)
    if not runs:
        raise ArgumentError("policies", "at least one", "none")
    if output is None:
        first = runs[0][1]
        shown = first.scenario if files else chosen
        start = seed if first.is_start_given else first.seed
        serve(runs, scenario=shown, seed=start, port=port, open_browser=not no_browser)
        return Exit.DONE
    if output.suffix == _PAGE:
        write_page(runs, output)
    else:
        _write_video(runs, output, always=progress)
    note(f"saved: {output}")
    return Exit.DONE


def _write_video(runs: _Runs, path: Path, *, always: bool) -> None:
    require("video", ["pygame", "imageio_ffmpeg"])
    from flockesc_env.render.video import write_video

    frames = max(run.scenario.num_steps for _, run in runs) + 1
    with progress_bar("Video", frames, always=always) as report:
        write_video(runs, path, progress=report)


def _run_policies(policies: tuple[str, ...], seed: int, scenario: FlockScenario) -> _Runs:
    found = [(spec, policy_of(spec)) for spec in policies]  # all names are checked before the first run
    return [(spec, policy.record(seed, scenario)) for spec, policy in found]


def _load_runs(files: tuple[Path, ...]) -> _Runs:
    runs = []
    for path in files:
        record = records.load_run(path)
        run = record.trajectory
        if not isinstance(run, Trajectory):
            raise ArgumentError("files", "runs of a flock", f"a line in {path}")
        runs.append((record.name or path.stem, run))
    return runs
