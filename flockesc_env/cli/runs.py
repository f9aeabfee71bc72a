"""The commands simulate, replay, presets and watch: run models once, replay and show runs, list scenarios."""

import tempfile
import webbrowser
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import Positional, arg

from flockesc_env.cli.flags import (
    EXPECTED,
    Json,
    Predator,
    Progress,
    ScenarioFlags,
    described,
    optional,
    policy_of,
    several,
)
from flockesc_env.cli.output import Exit, check_output, conclude, note, show
from flockesc_env.common.checks import as_seed
from flockesc_env.common.errors import FlockescError, InputError
from flockesc_env.common.extras import require
from flockesc_env.common.files import suffix_of, write_text
from flockesc_env.common.progress import progress_bar
from flockesc_env.models import records
from flockesc_env.models.simulate import LineTrajectory, Trajectory
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.registry import policy_file
from flockesc_env.policies.simulate import simulate as run_once
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.objectives import OBJECTIVES
from flockesc_env.scenario.presets import PRESETS, preset
from flockesc_env.watch.live import file_document, has_engine, page_spec, scenario_documents
from flockesc_env.watch.page import Content, render
from flockesc_env.watch.page import replay as replayed_content

BEST_RANGE = 12.0
"""The best fixed range for J_mean in the paper's flock, in m (results/scoreboard/README.md)."""

_PAGE, _VIDEOS = ".html", (".mp4", ".gif")
_DEFAULT = (f"fixed:{BEST_RANGE:g}", "stubborn-leaders")

_MEANINGS = {
    **{spec.name: f"{spec.with_unit(spec.symbol)}: {spec.definition}" for spec in OBJECTIVES},
    "num_components": "number of connected components of the neighbor graph at the end",
    "polarization": "norm of the mean heading at the end, from 0 to 1",
    "converged": "whether the line reached its steady state",
    "steps": "number of steps",
}


def simulate(
    scenario: ScenarioFlags,
    policy: Annotated[
        Positional[str | None],
        arg(
            help=f"policy that sets the ranges: {EXPECTED}; of a line, fixed:RHO",
            metavar="[POLICY]",
            help_behavior_hint=f"(default: fixed:{BEST_RANGE:g}, the best fixed range of the paper's flock)",
        ),
    ] = None,
    *,
    seed: Annotated[
        int | None,
        *optional("seed of the initial state, from 0 to 2^64 - 1", "a random seed, which is printed"),
    ] = None,
    predator: Predator = None,
    output: Annotated[
        Path | None, *optional("file (.npz) for the whole run; flockesc replay checks it", "none")
    ] = None,
    json: Json = False,
) -> Exit:
    """Run the model once.

    Prints the distances to the predator and the state at the end.

    The default scenario is that of a trained policy, or the paper's flock.

    Example: flockesc simulate fixed:10 --seed 7 --output run.npz
    """
    check_output(output, [".npz"])
    found = policy_of(policy or f"fixed:{BEST_RANGE:g}")
    chosen, hunter = scenario.hunted([found], predator)
    if policy is None:
        if isinstance(chosen, LineScenario):
            raise InputError("policy", "fixed:RHO for a line", "none")
        policy = found.name
    trajectory = run_once(chosen, policy=found, seed=seed, predator_policy=hunter)
    outcome = _outcome(trajectory)
    document = {
        **described("simulate", chosen, output),
        "policy": policy,
        "predator": predator,
        "seed": trajectory.seed,
        **outcome,
    }
    lines = [f"{chosen.num_agents} agents, {policy}, seed {trajectory.seed}"]
    for entry, value in outcome.items():
        shown = f"{value:.3f}" if isinstance(value, float) else str(value)
        lines.append(f"  {entry:<18} {shown:>8}  {_MEANINGS[entry]}")
    conclude(document if json else lines, output, partial(records.save_run, trajectory, name=policy))
    return Exit.DONE


def _outcome(run: Trajectory | LineTrajectory) -> dict[str, Any]:
    if isinstance(run, LineTrajectory):
        return {
            "escape_distance": float(run.escape_distance[-1]),
            "num_components": int(run.num_components[-1]),
            "converged": run.converged,
            "steps": run.steps,
        }
    return {
        **{spec.name: float(getattr(run, spec.series).min()) for spec in FlockScenario.objectives.values()},
        "num_components": int(run.num_components[-1]),
        "polarization": float(run.polarization[-1]),
    }


def replay(
    files: Annotated[
        Positional[tuple[Path, ...]],
        several("recorded runs (.npz) that flockesc simulate --output wrote", "FILE .."),
    ],
) -> Exit:
    """Run recorded runs again and compare every number with the record.

    Prints "matches" if all bits are equal, otherwise the attributes that differ.

    The exit code is 1 if a run differs, and 2 if a file is not a recorded run.

    Example: flockesc replay run.npz
    """
    if not files:
        raise InputError("files", "at least one file", "none")
    code = Exit.DONE
    for path in files:
        outcome, found = "matches", list[str]()
        try:
            run = records.load_run(path).trajectory
            found = records.run_differences(run, records.replay_run(run))
        except (FlockescError, OSError) as error:
            reason = getattr(error, "strerror", None) or str(error).removeprefix(f"{path}: ")
            note(f"error: {path}: {reason}")
            outcome, code = "refused", Exit.REFUSED
        if found:
            outcome, code = "differs", max(code, Exit.FAILED)
        show(f"{path}: {outcome}", *(f"  {line}" for line in found))
    return code


def presets(
    name: Annotated[
        Positional[str | None], *optional("preset to print as TOML", "list all", "[NAME]")
    ] = None,
) -> Exit:
    """List the preset scenarios, or print one as a scenario file.

    The flag --scenario of other commands takes the name of a preset or such a file.

    Example: flockesc presets pursuit > mine.toml
    """
    if name is None:
        width = max(map(len, PRESETS))
        show(*(f"{known:<{width}}  {PRESETS[known].description}" for known in PRESETS))
    else:
        lines = preset(name).to_toml().rstrip().split("\n")
        show(f"# {PRESETS[name].description}", *lines)
    return Exit.DONE


def watch(
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
    predator: Predator = None,
    output: Annotated[
        Path | None,
        *optional(
            "write a page (.html) or a video (.mp4, .gif; needs the video extra)",
            "write a page to a temporary file, and open it",
        ),
    ] = None,
    no_browser: Annotated[bool, arg(help="print the path of the page without opening a browser")] = False,
    progress: Progress = False,
) -> Exit:
    """Watch flocks in the browser: policies on one flock, or recorded runs.

    The page plays fixed ranges, networks and simple rules; others are recorded.

    With --predator, all are recorded.

    Example: flockesc watch fixed:12 stubborn-leaders --seed 242
    """
    check_output(output, [_PAGE, *_VIDEOS])
    specs = policies or _DEFAULT
    runs = {spec: _load_run(Path(spec)) for spec in specs if records.is_run(Path(spec))}
    found = [(spec, policy_of(spec)) for spec in specs if spec not in runs]
    known = [policy for _, policy in found if isinstance(policy.scenario, FlockScenario)]
    chosen, hunter = scenario.hunted(known, predator)
    if not isinstance(chosen, FlockScenario):
        raise InputError("scenario", "a scenario of a flock", "one of a line")

    is_video = output is not None and suffix_of(output) in _VIDEOS
    if is_video:
        require("video", ["pygame", "imageio_ffmpeg"])
    # Also those that a page plays by itself: one that cannot play is refused.
    given: Any = {"seed": seed, "predator_policy": hunter}
    played = {spec: (spec, run_once(chosen, policy=policy, **given)) for spec, policy in found}
    shown = [(runs | played)[spec] for spec in specs]
    if output is not None and is_video:
        from flockesc_env.render.video import write_video

        frames = max(run.scenario.num_steps for _, run in shown) + 1
        with progress_bar("Video", frames, always=progress) as report:
            write_video(shown, output, progress=report)
        note(f"saved: {output}")
        return Exit.DONE
    replays = runs or hunter or any(policy.opponent for _, policy in found)
    if replays or not has_engine():
        if not replays:
            note(
                "This build has no engine for pages: the page replays. `make engine` builds it in a checkout."
            )
        page = render(shown, replayed_content(shown))
    else:
        page = _policy_page(found, shown, seed, chosen)
    path = output or Path(tempfile.mkdtemp(prefix="flockesc-")) / f"flock{_PAGE}"
    write_text(path, page)
    if output is not None:
        note(f"saved: {output}")
        return Exit.DONE
    show(f"The page is {path}")
    if not no_browser:
        webbrowser.open(path.as_uri())
    return Exit.DONE


def _policy_page(
    policies: list[tuple[str, BasePolicy]],
    played: list[tuple[str, Trajectory]],
    seed: int,
    scenario: FlockScenario,
) -> str:
    """Return a page that simulates the policies it can, and replays the others."""
    specs = [page_spec(spec, policy) for spec, policy in policies]
    runs = [run for spec, run in zip(specs, played, strict=True) if spec is None]
    recordings = (f"recording:{index}" for index in range(len(runs)))
    shown = [spec or next(recordings) for spec in specs]
    networks = [file_document(path, spec) for spec in shown if (path := policy_file(spec)) is not None]
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
