"""The page of the survey, made from its results file: a row per preset, an answer per question."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from flockesc_env.common.stats import Estimate
from studies.pages import path_from, render
from studies.robustness.findings import RULE, Finding, Outcome
from studies.robustness.plan import Grid
from studies.robustness.questions import QUESTIONS
from studies.study import Results

FIGURE = "robustness"


@dataclass(frozen=True)
class PresetResult:
    """One row: a preset, the question that it answers, its grid, and outcomes by the objectives' symbols."""

    name: str
    description: str
    question: str
    grid: Grid
    outcomes: dict[str, Outcome]


@dataclass(frozen=True)
class RobustnessResults(Results):
    """Results of the survey; ``num_flocks`` choose the ranges, and as many others measure them."""

    command: str
    num_flocks: int
    presets: tuple[PresetResult, ...]
    versions: dict[str, str]


@dataclass(frozen=True)
class Answer:
    """The presets of one question: those with an interior best range, and the others with their findings."""

    question: str
    interior: Sequence[str]
    others: Sequence[tuple[str, Finding]]

    def __str__(self) -> str:
        if not self.others:
            return f"yes: {', '.join(self.interior)}"
        named = "; ".join(f"{name} ({finding})" for name, finding in self.others)
        if not self.interior:
            return f"not shown: {named}"
        number = len(self.interior) + len(self.others)
        return f"in {len(self.interior)} of {number}: {', '.join(self.interior)}; not shown for {named}"


def answers(results: RobustnessResults, symbol: str) -> list[Answer]:
    """Return the answers to all questions for one objective."""
    found = []
    for question in QUESTIONS:
        rows = {row.name: row.outcomes[symbol].finding for row in results.presets if row.question == question}
        others = [(name, finding) for name, finding in rows.items() if finding is not Finding.INTERIOR]
        if rows:
            found.append(Answer(question, [name for name in rows if name not in dict(others)], others))
    return found


def markdown_page(results: RobustnessResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the picture in the folder ``figures``."""
    return render(
        "robustness/robustness.md",
        results=results,
        answers={symbol: answers(results, symbol) for symbol in results.presets[0].outcomes},
        grids=sorted({str(row.grid) for row in results.presets}),
        picture=path_from(page, figures / f"{FIGURE}.png"),
        rule=RULE,
        place=_place,
    )


def _place(best: Estimate, unit: str) -> str:
    return f"{best.mean:g} [{best.low:g}, {best.high:g}] {unit}"
