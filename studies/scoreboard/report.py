"""The report of the scoreboard: the entries of all tasks, best first."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.taskset import Result, tasks
from flockesc_env.taskset.statistics import difference
from flockesc_env.taskset.task import FLOCKS, VERSION
from studies.scoreboard import board, rewards
from studies.scoreboard.board import Entrant, score_of, scores_of, with_reference_error
from studies.study import template

RESULTS: Final = Path("results/scoreboard")


@dataclass(frozen=True)
class Entry:
    """A row of a task's table: a learner or rule, its score, and its paired difference to the shortcut."""

    entrant: Entrant
    result: Result
    score: Estimate
    over_shortcut: Estimate

    @property
    def by_seed(self) -> FloatArray:
        """The mean score of every training seed."""
        by_seed: FloatArray = scores_of(self.result).mean(axis=1)
        return by_seed

    @property
    def is_learned(self) -> bool:
        """Whether a network was trained: by a search, imitation or reinforcement learning."""
        return self.result.training is not None and "rule" not in self.result.learner

    @property
    def group(self) -> int:
        """Place of the row's table: 0 for rules, 1 at the task's samples (within 2 %), 2 at others."""
        training, samples = self.result.training, tasks[self.result.task].samples
        return 0 if training is None else 1 + (abs(training.samples - samples) > 0.02 * samples)


def entries_of(entrants: Sequence[Entrant]) -> dict[str, list[Entry]]:
    """Return the entries of every task, the highest score first."""
    entries: dict[str, list[Entry]] = {}
    for name, task in tasks.items():
        results = {entrant: entrant.results[name] for entrant in entrants if name in entrant.results}
        (shortcut,) = (one for one in results.values() if one.policies[0].policy == task.shortcut.policy)
        found = []
        for entrant, result in results.items():
            over = difference(scores_of(result), scores_of(shortcut))
            found.append(Entry(entrant, result, score_of(result), with_reference_error(over, task)))
        entries[name] = sorted(found, key=lambda entry: -entry.score.mean)
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
    found = []
    for name, shown in entries.items():
        (ppo,) = (entry for entry in shown if entry.result.learner == "ppo")
        for result in (one for one in results if one.task == name):
            assert result.training is not None  # noqa: S101, an ablation is trained
            change = result.training.hyperparameters["note"].removeprefix(board.ABLATION)
            found.append(Ablation(name, change, score_of(result), ppo.score))
    return sorted(found, key=lambda one: (list(entries).index(one.task), -one.changed.mean))


def report(entrants: Sequence[Entrant]) -> str:
    """Return the report as Markdown."""
    entries = entries_of(entrants)
    every = [(name, entry) for name, shown in entries.items() for entry in shown if entry.result.training]
    gains = json.loads(rewards.FILE.read_text())
    text = template("scoreboard/templates/scoreboard.md").render(
        tasks=tasks,
        entries=entries,
        ablations=ablations_of(board.load_ablations(), entries),
        lost=[(name, entry) for name, entry in every if entry.over_shortcut.high < 0],
        below=[(name, entry) for name, entry in every if entry.score.high < 0],
        trained=len(every),
        board=entrants,
        folder=board.BOARD,
        version=VERSION,
        flocks=FLOCKS,
        choosing=len(board.CHOOSING),
        controlling=board.CONTROLLING,
        median=np.median,
        estimate=lambda triple: Estimate(*triple),
        compat=json.loads((RESULTS / "compat.json").read_text()),
        any_rate=json.loads(board.ANY_RATE.read_text()),
        gains=gains,
        measured=len(rewards.FLOCKS),
        opposite=[name for name, rows in gains.items() if any(map(rewards.is_opposite, rows))],
    )
    return text.rstrip() + "\n"
