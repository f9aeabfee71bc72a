"""The command line ``python -m studies``: its commands, without their heavy imports."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

from flockesc_env import jobs
from flockesc_env.cli.application import Application
from flockesc_env.cli.flags import Backend, optional
from flockesc_env.cli.output import Exit, check_output, note, show
from flockesc_env.common.checks import as_count
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import require
from flockesc_env.common.files import write_text
from studies.paper.plan import BATCH, LEAST_FLOCKS, Trials
from studies.robustness import attacked_presets
from studies.validation import PARTS

if TYPE_CHECKING:  # slow to import
    from studies.measurements import Runner

_LIBRARIES = {
    "analysis": ["matplotlib", "scipy", "jinja2"],
    "train": ["matplotlib", "polars", "jinja2", "cmaes"],
}

_Output = Annotated[Path, arg(help="folder of results, figures and the report README.md; made if missing")]
_Share = Annotated[float, arg(help="share of the flocks that run")]
_RUNS = Path("runs/scoreboard")

_STUDIES = {
    "paper": ("studies.paper.report:PAPER", "analysis"),
    "robustness": ("studies.robustness.survey:ROBUSTNESS", "analysis"),
    "scaling": ("studies.scaling.survey:SCALING", "analysis"),
    "validation": ("studies.validation.survey:VALIDATION", "analysis"),
    "findings": ("studies.findings.report:FINDINGS", "train"),
}
"""Where each study is and the extra that it needs, by its folder in results/. Their imports are slow."""


def paper(
    *,
    output: _Output = Path("runs/paper"),
    flocks: Annotated[int, arg(help=f"flocks per range, at least {LEAST_FLOCKS}")] = Trials.flocks,
    lines: Annotated[int, arg(help=f"lines per range, at least {BATCH}")] = Trials.lines,
    figures: Annotated[
        tuple[str, ...],
        arg(
            help="write only these figures, 2 to 10, edge or force, and measure only what they show",
            metavar="[NUMBER ..]",
            help_behavior_hint="(default: all, and the report)",
        ),
    ] = (),
    backend: Backend = "processes",
) -> Exit:
    """Set the paper's claims and figures beside what this package measures.

    Writes README.md, figures, results.json.

    Takes about a quarter of an hour on two cores; interrupted, run it again to continue.

    Example: python -m studies paper --output runs/paper --figures 5 9
    """
    trials = Trials(flocks=flocks, lines=lines)
    if not figures:
        return _run("paper", output, backend, trials=trials)
    runner = _runner(output, "analysis", backend)
    from studies.paper.figures import measure_and_draw

    for file in measure_and_draw(runner, output, figures, trials):
        note(f"saved: {file}")
    return Exit.DONE


def robustness(
    *,
    output: _Output = Path("runs/robustness"),
    num_flocks: Annotated[int, arg(help="flocks that choose a range, and as many that measure it")] = 500,
    presets: Annotated[
        tuple[str, ...] | None,
        *optional(
            "which presets or scenario files (.toml, .json)",
            "all flock presets that have predators",
            metavar="NAME|FILE ..",
        ),
    ] = None,
    backend: Backend = "processes",
) -> Exit:
    """Find the best fixed range in every preset: does the paper's finding survive?

    Writes README.md, robustness.png, results.json.

    About 35 minutes on two cores; interrupted, run it again to continue.

    Example: python -m studies robustness --num-flocks 50 --presets paper-flock pursuit
    """
    as_count(num_flocks, "num_flocks", least=2)  # without two there is no interval
    attacked_presets(presets)  # refuses unknown ones before heavy imports
    return _run("robustness", output, backend, num_flocks=num_flocks, names=presets)


def validation(
    *,
    output: _Output = Path("results/validation"),
    only: Annotated[
        tuple[str, ...],
        arg(
            help="measure these results; the others keep their stored ones",
            metavar="NAME ..",
            help_behavior_hint=f"(default: all: {', '.join(PARTS)})",
        ),
    ] = PARTS,
    scale: _Share = 1.0,
    backend: Backend = "processes",
) -> Exit:
    """Published results of other models and flocks, measured again with this simulator.

    Interrupted, run it again to continue.

    Example: python -m studies validation --only vicsek --scale 0.1
    """
    for name in only:
        if name not in PARTS:
            raise InputError("only", f"any of {', '.join(PARTS)}", repr(name))
    return _run("validation", output, backend, only=only, scale=scale)


def findings(
    *, output: _Output = Path("results/findings"), scale: _Share = 1.0, backend: Backend = "processes"
) -> Exit:
    """Choose the best trained policy of each task, and measure how it works and where it loses.

    Interrupted, run it again to continue.

    Example: python -m studies findings --scale 0.1
    """
    return _run("findings", output, backend, scale=scale)


def scaling(
    *, output: _Output = Path("results/scaling"), scale: _Share = 1.0, backend: Backend = "processes"
) -> Exit:
    """Measure the best range in flocks of other sizes, dimensions, speeds and noise, and its law.

    About an hour on one core; interrupted, run it again to continue.

    Example: python -m studies scaling --scale 0.01
    """
    return _run("scaling", output, backend, scale=scale)


def scoreboard_freeze(
    names: Annotated[Positional[tuple[str, ...]], arg(help="tasks; none: all", metavar="TASK")] = (),
    *,
    backend: Backend = "processes",
) -> Exit:
    """Measure again what normalizes scores, and write it into the file of the tasks (about an hour).

    Example: python -m studies scoreboard-freeze one-range
    """
    runner = _runner(_RUNS, "train", backend)
    from studies.scoreboard.freeze import FILE, freeze

    freeze(names, runner)
    return _saved(FILE)


def scoreboard_train(
    *,
    learners: Annotated[tuple[str, ...], arg(help="some of the learners; none: all")] = (),
    tasks: Annotated[tuple[str, ...], arg(help="some of the tasks; none: all")] = (),
    runs: Annotated[Path, arg(help="folder that keeps finished parts")] = _RUNS,
    backend: Backend = "processes",
) -> Exit:
    """Train learners (hours for all), and score them and the rules that have no result yet.

    Interrupted, it continues.

    Example: python -m studies scoreboard-train --learners ppo --tasks one-range
    """
    runner = _runner(runs, "train", backend)
    from studies.scoreboard.board import write_scores
    from studies.scoreboard.trainings import trainings

    write_scores(runner.run(trainings(learners, tasks, runs), "Training"))
    return Exit.DONE


def scoreboard_rewards(*, backend: Backend = "processes") -> Exit:
    """Measure which ranges the individual reward prefers, and which the flock does (minutes).

    Example: python -m studies scoreboard-rewards
    """
    runner = _runner(_RUNS, "train", backend)
    from studies.scoreboard.rewards import FILE, write

    write(runner)
    return _saved(FILE)


def reports() -> Exit:
    """Write the reports of all studies from results/ again, and copy the policies of the wheel.

    Prints the README's table of tasks.

    Example: python -m studies reports
    """
    require("train", _LIBRARIES["train"])
    from studies.findings.report import rows_of, tasks_table
    from studies.scoreboard.board import load_board, ship
    from studies.scoreboard.report import RESULTS, entries_of, report
    from studies.study import REPORT

    for name, (place, _) in _STUDIES.items():
        resolve_name(place).write(Path("results", name))
    board = load_board()
    ship(board)
    write_text(RESULTS / REPORT, report(board))
    show(*tasks_table(rows_of(entries_of(board))).split("\n"))
    return Exit.DONE


def _run(study: str, output: Path, backend: str, **options: Any) -> Exit:
    """Measure one of ``_STUDIES`` with its options; write its results, figures and report."""
    if not 0 < options.get("scale", 1) <= 1:
        raise InputError("scale", "a number in (0, 1]", options["scale"])
    place, extra = _STUDIES[study]
    runner = _runner(output, extra, backend)
    resolve_name(place).run(runner, output, **options)
    return _saved(output)


def _saved(path: Path) -> Exit:
    note(f"saved: {path}")
    return Exit.DONE


def _runner(folder: Path, extra: str, backend: str) -> Runner:
    """Check that libraries are installed and files can be written; return a runner that keeps results."""
    runs_on = jobs.find_backend(backend)
    check_output(folder)
    require(extra, _LIBRARIES[extra])
    from studies.measurements import Runner

    return Runner(jobs.Cache(folder / "cache"), runs_on)


_MEASURING = (paper, robustness, scaling, validation, findings)
_SCOREBOARD = (scoreboard_freeze, scoreboard_train, scoreboard_rewards)
_COMMANDS: dict[str, Callable[..., Exit]] = {
    command.__name__.replace("_", "-"): command for command in (*_MEASURING, *_SCOREBOARD, reports)
}
STUDIES = Application("python -m studies", "Studies made with flockesc_env.", _COMMANDS)

if __name__ == "__main__":
    sys.exit(STUDIES.main())
