"""The commands ``python -m studies scoreboard-*``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from flockesc_env.cli.flags import Backend
from flockesc_env.cli.output import Exit, note, show
from flockesc_env.jobs import Cache
from studies.flags import prepare

Runs = Annotated[Path, arg(help="folder of training runs; finished ones are kept, others continued")]
Parts = Annotated[Path, arg(help="folder that keeps finished parts")]
RUNS = Path("runs/scoreboard")


def freeze(
    names: Annotated[Positional[tuple[str, ...]], arg(help="tasks; none: all", metavar="TASK")] = (),
    *,
    output: Annotated[Path, arg(help="file of the tasks")] = Path("flockesc_env/tasks/v1.toml"),
    runs: Parts = RUNS,
    backend: Backend = "processes",
) -> Exit:
    """Measure again what normalizes scores, and write it into the file of the tasks (about an hour).

    Example: python -m studies scoreboard-freeze one-range
    """
    jobs = prepare(runs, "train", backend=backend)
    from studies.measurements import Runner
    from studies.scoreboard.freeze import freeze as write

    write(output, names, Runner(Cache(runs / "cache"), jobs, progress=True))
    note(f"saved: {output}")
    return Exit.DONE


def train(
    *,
    learners: Annotated[tuple[str, ...], arg(help="some of the learners; none: all")] = (),
    tasks: Annotated[tuple[str, ...], arg(help="some of the tasks; none: all")] = (),
    most_seeds: Annotated[int, arg(help="at most this number of training seeds")] = 10,
    runs: Runs = RUNS,
    backend: Backend = "processes",
) -> Exit:
    """Train learners (hours for all), and score them and the rules that have no result yet.

    Interrupted, it continues.

    Example: python -m studies scoreboard-train --learners ppo --tasks one-range
    """
    jobs = prepare(runs, "train", backend=backend)
    from studies.measurements import Runner
    from studies.scoreboard.board import write_scores
    from studies.scoreboard.trainings import trainings

    chosen = trainings(learners, tasks, most_seeds, runs)
    write_scores(Runner(Cache(runs / "cache"), jobs, progress=True).each(chosen, "Training"))
    return Exit.DONE


def rewards(*, runs: Parts = RUNS, backend: Backend = "processes") -> Exit:
    """Measure which ranges the individual reward prefers, and which the flock does (minutes).

    Example: python -m studies scoreboard-rewards
    """
    jobs = prepare(runs, "train", backend=backend)
    from studies.measurements import Runner
    from studies.scoreboard.rewards import FILE, write

    write(Runner(Cache(runs / "cache"), jobs, progress=True))
    note(f"saved: {FILE}")
    return Exit.DONE


def page(
    *, page: Annotated[Path, arg(help="file of the Markdown page")] = Path("docs/scoreboard.md")
) -> Exit:
    """Write the page of the scoreboard, print the README's table, and copy the policies of the wheel.

    Example: python -m studies scoreboard-page
    """
    prepare(None, "train", page=page)
    from flockesc_env.policies.registry import TRAINED
    from studies.scoreboard.board import load_board, shipped
    from studies.scoreboard.page import write_page

    board = load_board()
    for name, content in shipped(board).items():
        file = TRAINED / f"{name}.npz"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    show(*write_page(board, page).split("\n"))
    note(f"saved: {page}")
    return Exit.DONE
