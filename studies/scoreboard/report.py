"""The report of the scoreboard: the entries of all tasks, best first."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.policies import load_policy
from flockesc_env.taskset import Result, read_result, tasks
from flockesc_env.taskset.task import FLOCKS, VERSION
from studies.scoreboard import board, rewards
from studies.scoreboard.board import Entrant, score_of, scores_of, with_reference_error
from studies.scoreboard.statistics import difference
from studies.study import template

RESULTS: Final = Path("results/scoreboard")

GROUPS: Final = (
    "rules",
    "at the task's samples",  # within 2 %
    "at other samples, not ranked",
    "played by its author's code, neither verified nor ranked",
)


@dataclass(frozen=True)
class Entry:
    """A row of a task's table: a learner or rule, its score, and its paired difference to the chosen rule."""

    entrant: Entrant
    result: Result
    score: Estimate
    over_rule: Estimate

    @property
    def by_seed(self) -> FloatArray:
        """The mean score of every training seed."""
        by_seed: FloatArray = scores_of(self.result).mean(axis=1)
        return by_seed

    @property
    def is_learned(self) -> bool:
        """Whether a network was trained, by a search, imitation or reinforcement learning, in a file."""
        has_network = self.result.training is not None and "rule" not in self.result.learner
        return has_network and not self.result.is_code

    @property
    def chosen(self) -> list[str]:
        """The rule that every training seed chose, with its numbers."""
        texts = []
        for one in self.result.policies:
            rule: Any = load_policy(board.BOARD / self.result.learner / one.policy)
            arguments = [f"{number:.3g}" for number in rule.parameters]
            if hasattr(rule, "criterion"):
                arguments.append(rule.criterion)
            texts.append(f"`{type(rule).__name__}({', '.join(arguments)})`")
        return texts

    @property
    def starts(self) -> int:
        """Number of training seeds that return the best fixed range, at which they started."""
        return int((np.abs(scores_of(self.result)).max(axis=1) < 1e-3).sum())

    @property
    def group(self) -> int:
        """Place of the row's table in the order of ``GROUPS``."""
        training, samples = self.result.training, tasks[self.result.task].samples
        if self.result.is_code:
            return 3
        if training is None or not self.is_learned:
            return 0
        return 1 + (abs(training.samples - samples) > 0.02 * samples)


def entries_of(entrants: Sequence[Entrant]) -> dict[str, list[Entry]]:
    """Return the entries of every task, the highest score first."""
    entries: dict[str, list[Entry]] = {}
    for name, task in tasks.items():
        results = {entrant: entrant.results[name] for entrant in entrants if name in entrant.results}
        (rule,) = (one for one in results.values() if one.learner == "rule")
        found = []
        for entrant, result in results.items():
            over = difference(scores_of(result), scores_of(rule))
            found.append(Entry(entrant, result, score_of(result), with_reference_error(over, task)))
        entries[name] = sorted(found, key=lambda entry: -entry.score.mean)
    return entries


def best_learned(shown: Sequence[Entry]) -> Entry:
    """Return the entry with the highest score of those that were learned."""
    return next(entry for entry in shown if entry.is_learned)


def report(entrants: Sequence[Entrant]) -> str:
    """Return the report as Markdown."""
    entries = entries_of(entrants)
    every = [(name, entry) for name, shown in entries.items() for entry in shown if entry.is_learned]
    gains = json.loads(rewards.FILE.read_text())
    changed = [read_result(file) for file in sorted(board.ABLATIONS.glob("*/*.json"))]
    ablations = [(result, score_of(result)) for result in changed]
    text = template("scoreboard/templates/scoreboard.md", globals()).render(
        entries=entries,
        ablations=sorted(ablations, key=lambda one: ([*tasks].index(one[0].task), -one[1].mean)),
        order=sorted(entries, key=lambda name: best_learned(entries[name]).over_rule.mean),
        constants=json.loads(board.CONSTANTS.read_text()),
        below=[(name, entry) for name, entry in every if entry.score.high < 0],
        entrants=entrants,
        version=VERSION,
        flocks=FLOCKS,
        median=np.median,
        estimate=lambda triple: Estimate(*triple),
        compat=json.loads((RESULTS / "compat.json").read_text()),
        any_rate=json.loads(board.ANY_RATE.read_text()),
        gains=gains,
        opposite=[name for name, rows in gains.items() if any(map(rewards.is_opposite, rows))],
    )
    return text.rstrip() + "\n"
