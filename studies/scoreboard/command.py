"""The commands ``python -m studies scoreboard-*``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from flockesc_env.cli.exits import Exit
from flockesc_env.cli.flags import Backend
from flockesc_env.cli.output import note
from flockesc_env.jobs import Cache
from studies.flags import prepare

RUNS = Path("runs/scoreboard")


def freeze(
    *,
    output: Annotated[Path, arg(help="file of the tasks")] = Path("flockesc_env/tasks/v1.toml"),
    runs: Annotated[Path, arg(help="folder that keeps finished parts")] = RUNS,
    backend: Backend = "processes",
) -> Exit:
    """Measure what normalizes scores, and write the file of the tasks (about 15 minutes).

    Example: python -m studies scoreboard-freeze --output v2.toml
    """
    jobs = prepare(runs, "train", backend=backend)
    from studies.measurements import Runner
    from studies.scoreboard.freeze import freeze as write

    write(output, Runner(Cache(runs / "cache"), jobs, progress=True))
    note(f"saved: {output}")
    return Exit.DONE


def train(
    *,
    learners: Annotated[tuple[str, ...], arg(help="some of the learners; none: all")] = (),
    tasks: Annotated[tuple[str, ...], arg(help="some of the tasks; none: all")] = (),
    most_seeds: Annotated[int, arg(help="at most this number of training seeds")] = 10,
    runs: Annotated[Path, arg(help="folder that keeps finished parts")] = RUNS,
    backend: Backend = "processes",
) -> Exit:
    """Train the baselines (some hours); finished runs are kept, so it continues after an interrupt.

    Example: python -m studies scoreboard-train --learners sb3-ppo --tasks shared
    """
    jobs = prepare(runs, "train", backend=backend)
    from studies.measurements import Runner
    from studies.scoreboard.baselines import train_all, trainings

    chosen = trainings(learners, tasks, most_seeds)
    train_all(chosen, Runner(Cache(runs / "cache"), jobs, progress=True))
    note(f"{len(chosen)} training runs are in {runs / 'cache'}")
    return Exit.DONE


def submit(*, runs: Annotated[Path, arg(help="folder that keeps finished parts")] = RUNS) -> Exit:
    """Score the rules, the policies of the study of learned ranges and the trained baselines (about an hour).

    Results that exist are kept. Learning curves go into results/scoreboard.

    Example: python -m studies scoreboard-submit
    """
    prepare(None, "train")
    from studies.scoreboard.baselines import trainings
    from studies.scoreboard.page import write_curves
    from studies.scoreboard.submissions import write_own

    cache = Cache(runs / "cache")
    found = {run: cache.find(job) for run, job in trainings((), (), 10).items()}
    trained = {run: arrays for run, arrays in found.items() if arrays is not None}
    write_own(trained)
    write_curves(trained)
    return Exit.DONE


def page(
    *, page: Annotated[Path, arg(help="file of the Markdown page")] = Path("docs/scoreboard.md")
) -> Exit:
    """Write the page of the benchmark from its submissions.

    Example: python -m studies scoreboard-page
    """
    prepare(None, "train", page=page)
    import polars as pl

    from studies.scoreboard.page import CURVES_FILE, RESULTS, write_page
    from studies.scoreboard.submissions import load_submissions

    write_page(load_submissions(), pl.read_parquet(RESULTS / CURVES_FILE), page)
    note(f"saved: {page}")
    return Exit.DONE
