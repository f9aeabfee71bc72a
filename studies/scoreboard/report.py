"""The report of the scoreboard: the entries of all tasks, best first."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from flockesc_env.common.stats import Estimate
from flockesc_env.taskset import Result, tasks
from flockesc_env.taskset.definition import FLOCKS, VERSION
from flockesc_env.taskset.statistics import difference
from studies.scoreboard import rewards
from studies.scoreboard.board import (
    ABLATION,
    ANY_RATE,
    BOARD,
    CHOOSING,
    CONTROLLING,
    Entrant,
    load_ablations,
)
from studies.scoreboard.rows import Row, rows, scores_of, with_reference_error
from studies.study import template

RESULTS: Final = Path("results/scoreboard")


@dataclass(frozen=True)
class Entry:
    """A row of a task's table: a learner or rule, its score, and its paired difference to the shortcut."""

    entrant: Entrant
    row: Row
    over_shortcut: Estimate

    @property
    def result(self) -> Result:
        """The result."""
        return self.row.result

    @property
    def is_learned(self) -> bool:
        """Whether a network was trained: by a search, imitation or reinforcement learning."""
        return self.result.training is not None and "rule" not in self.result.learner

    @property
    def group(self) -> int:
        """Place of the row's table: 0 for rules, 1 at the task's samples (within 2 %), 2 at others."""
        training, samples = self.result.training, tasks[self.result.task].samples
        return 0 if training is None else 1 + (abs(training.samples - samples) > 0.02 * samples)


def entries_of(board: Sequence[Entrant]) -> dict[str, list[Entry]]:
    """Return the rows of every task, the highest score first."""
    by_name = {entrant.name: entrant for entrant in board}
    found = rows([result for entrant in board for result in entrant.results.values()])
    entries: dict[str, list[Entry]] = {}
    for name, task in tasks.items():
        (shortcut,) = (
            row.result for row in found[name] if row.result.policies[0].policy == task.shortcut.policy
        )
        for row in found[name]:
            over = difference(scores_of(row.result), scores_of(shortcut))
            entry = Entry(by_name[row.result.learner], row, with_reference_error(over, task))
            entries.setdefault(name, []).append(entry)
    return entries


@dataclass(frozen=True)
class Ablation:
    """A change of one choice of ``ppo`` on a task: the scores with it and without it."""

    task: str
    change: str
    changed: Estimate
    unchanged: Estimate


def ablations_of(results: Sequence[Result], entries: dict[str, list[Entry]]) -> list[Ablation]:
    """Return the ablations of every task, the highest score first."""
    by_task = rows(results)
    found = []
    for name in filter(by_task.get, entries):
        (ppo,) = (entry for entry in entries[name] if entry.result.learner == "ppo")
        for row in by_task[name]:
            assert row.result.training is not None  # noqa: S101, an ablation is trained
            change = row.result.training.hyperparameters["note"].removeprefix(ABLATION)
            found.append(Ablation(name, change, row.score, ppo.row.score))
    return found


def report(board: Sequence[Entrant]) -> str:
    """Return the report as Markdown."""
    entries = entries_of(board)
    every = [(name, entry) for name, shown in entries.items() for entry in shown if entry.result.training]
    gains = json.loads(rewards.FILE.read_text())
    text = template("scoreboard/templates/scoreboard.md").render(
        tasks=tasks,
        entries=entries,
        ablations=ablations_of(load_ablations(), entries),
        lost=[(name, entry) for name, entry in every if entry.over_shortcut.high < 0],
        below=[(name, entry) for name, entry in every if entry.row.score.high < 0],
        trained=len(every),
        board=board,
        folder=BOARD,
        version=VERSION,
        flocks=FLOCKS,
        choosing=len(CHOOSING),
        controlling=CONTROLLING,
        median=np.median,
        estimate=lambda triple: Estimate(*triple),
        compat=json.loads((RESULTS / "compat.json").read_text()),
        any_rate=json.loads(ANY_RATE.read_text()),
        gains=gains,
        measured=len(rewards.FLOCKS),
        opposite=[name for name, rows in gains.items() if any(map(rewards.is_opposite, rows))],
    )
    return text.rstrip() + "\n"
