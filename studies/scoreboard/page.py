"""The page of the benchmark, its figure of learning curves, and the present best of every task."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import CONFIDENCE, Estimate
from flockesc_env.jobs import Arrays
from flockesc_env.tasks.report import Row, rows, scores_of, with_reference_error
from flockesc_env.tasks.results import Result
from flockesc_env.tasks.standings import Standing, write_standings
from flockesc_env.tasks.statistics import difference
from flockesc_env.tasks.task import FLOCKS, VERSION, Task, tasks
from studies.pages import path_from, render
from studies.scoreboard.baselines import SEEDS, Run
from studies.scoreboard.submissions import SUBMISSIONS, Submission
from training.figure_style import save_figure

RESULTS: Final = Path("results/scoreboard")
CURVES_FILE: Final = "curves.parquet"


@dataclass(frozen=True)
class Entry:
    """A row of a task's table: a submission, its score, and its paired difference to the known shortcut."""

    submission: Submission
    row: Row
    over_shortcut: Estimate

    @property
    def result(self) -> Result:
        """The result."""
        return self.row.result

    @property
    def minutes(self) -> str:
        """Median processor time of a training run in minutes."""
        training = self.result.training
        return f"{np.median(training.cpu_minutes):.1f}" if training else "-"

    @property
    def samples(self) -> str:
        """Number of actions of a training run."""
        return f"{self.result.training.samples:,}" if self.result.training else "-"

    @property
    def is_equal(self) -> bool:
        """Whether the learner took the samples of the task; a run ends with a whole round."""
        training, most = self.result.training, tasks()[self.result.task].samples
        return training is not None and most <= training.samples < 1.1 * most


def entries_of(submissions: Iterable[Submission]) -> dict[str, list[Entry]]:
    """Return the rows of every task, the highest score first."""
    by_name = {submission.name: submission for submission in submissions}
    found = rows([result for submission in by_name.values() for result in submission.results.values()])
    return {
        name: [
            Entry(by_name[row.result.learner], row, _over(row.result, _shortcut(task, found[name])))
            for row in found[name]
        ]
        for name, task in tasks().items()
    }


def write_page(submissions: Sequence[Submission], curves: pl.DataFrame, page: Path) -> None:
    """Write the page, the figure of learning curves and the present best of every task."""
    entries = entries_of(submissions)
    best = {name: shown[0] for name, shown in entries.items()}
    write_standings(
        {
            name: Standing(
                learner=one.result.learner, kind=one.submission.card.kind, score=one.row.score.mean
            )
            for name, one in best.items()
        }
    )
    save_figure(_curves(curves), RESULTS / "learning_curves", ("png",))
    every = [(name, entry) for name, shown in entries.items() for entry in shown]
    equal: dict[str, dict[str, Entry]] = {}
    for name, entry in every:
        if entry.is_equal and entry.result.learner in SEEDS:
            equal.setdefault(entry.result.learner, {})[name] = entry
    text = render(
        "scoreboard/scoreboard.md",
        tasks=tasks(),
        entries=entries,
        lost=[
            (name, entry) for name, entry in every if entry.result.training and entry.over_shortcut.high < 0
        ],
        below=[(name, entry) for name, entry in every if entry.result.training and entry.row.score.high < 0],
        trained=sum(entry.result.training is not None for _, entry in every),
        equal=equal,
        submissions=submissions,
        link=lambda path: path_from(page, Path(path)),
        folder=SUBMISSIONS,
        results=RESULTS,
        version=VERSION,
        flocks=FLOCKS,
        confidence=CONFIDENCE,
        actor=_actor,
        seen=_seen,
        estimate=lambda triple: Estimate(*triple),
        compat=json.loads((RESULTS / "compat.json").read_text()),
    )
    write_text(page, text.rstrip() + "\n")


def write_curves(trained: Mapping[Run, Arrays], folder: Path = RESULTS) -> None:
    """Write the learning curves of the training runs that have one."""
    tables = [
        pl.DataFrame(
            {
                "learner": run.learner,
                "task": run.task,
                "seed": run.seed,
                "samples": found["curve_samples"].astype(np.int64),
                "cpu_minutes": found["curve_cpu_seconds"] / 60,
                "objective": found["curve_objective"],
            }
        )
        for run, found in trained.items()
        if "curve_samples" in found
    ]
    folder.mkdir(parents=True, exist_ok=True)
    write_table(pl.concat(tables), folder / CURVES_FILE)


def _shortcut(task: Task, shown: Sequence[Row]) -> Result:
    (shortcut,) = (row.result for row in shown if row.result.learner == task.shortcuts[0].policy)
    return shortcut


def _over(result: Result, other: Result) -> Estimate:
    found = difference(scores_of(result), scores_of(other))
    return with_reference_error(found, tasks()[result.task])


def _actor(task: Task) -> str:
    return "agent" if task.per_agent else task.spec.model


def _seen(task: Task) -> str:
    """Return what a policy observes of the predator, in words."""
    if task.spec.model == "line":
        return "whole line"
    if "profile_ranges" in task.options:
        return "predator; 8 candidate ranges"
    return "predator" if task.options["predator_sensing_range"] is None else "predator within 30 m"


def _curves(curves: pl.DataFrame) -> Figure:
    """Return learning curves over samples and over processor time, one row of panels per task."""
    names = curves["task"].unique(maintain_order=True).to_list()
    figure = Figure(figsize=(9, 2.4 * len(names)), layout="constrained")
    panels: Any = figure.subplots(len(names), 2, sharey="row", squeeze=False)
    for axes, name in zip(panels, names, strict=True):
        shown = curves.filter(task=name)
        for at, learner in enumerate(shown["learner"].unique(maintain_order=True)):
            for label, run in enumerate(shown.filter(learner=learner).partition_by("seed")):
                style: dict[str, Any] = {"color": f"C{at}", "alpha": 0.6, "linewidth": 1}
                title = learner if label == 0 else None
                axes[0].plot(run["samples"] / 1e6, run["objective"], label=title, **style)
                axes[1].plot(run["cpu_minutes"], run["objective"], **style)
        task = tasks()[name]
        axes[0].set(title=name, xlabel="samples (millions)", ylabel=task.spec.with_unit(task.spec.symbol))
        axes[1].set(xlabel="processor time (minutes)")
        axes[0].legend(fontsize="small")
    return figure
