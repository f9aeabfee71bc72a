"""The page of the survey, made from its results file: a row per preset, an answer per question."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from flockesc_env.common.stats import Estimate
from studies.pages import path_from, templates
from studies.robustness.findings import RULE, Finding, Outcome
from studies.robustness.plan import Grid
from studies.robustness.questions import QUESTIONS

RESULTS_FILE = "results.json"
FIGURE = "robustness"


@dataclasses.dataclass(frozen=True)
class PresetResult:
    """One row.

    Attributes:
        name: of the preset.
        description: of the preset.
        question: how it differs from the paper, a key of ``QUESTIONS``.
        grid: the actions that were tried.
        outcomes: by the objectives' symbols.
    """

    name: str
    description: str
    question: str
    grid: Grid
    outcomes: dict[str, Outcome]


@dataclasses.dataclass(frozen=True)
class RobustnessResults:
    """Results of the survey, from which page and figure are made.

    Attributes:
        command: the command that gives these results.
        num_flocks: flocks in each half: ranges are chosen on the seeds from 0, measured on those from here.
        presets: the rows.
        versions: of Python and of the packages.
    """

    command: str
    num_flocks: int
    presets: tuple[PresetResult, ...]
    versions: dict[str, str]

    def to_json(self) -> str:
        """Return the results as a JSON document; equal results give equal bytes."""
        return json.dumps(dataclasses.asdict(self), indent=1) + "\n"

    @classmethod
    def from_json(cls, document: str) -> RobustnessResults:
        """Build results from their JSON document."""
        fields = json.loads(document)
        return cls(**{**fields, "presets": tuple(_preset(row) for row in fields["presets"])})


@dataclasses.dataclass(frozen=True)
class Answer:
    """The findings of the presets of one question.

    Attributes:
        question: a key of ``QUESTIONS``.
        interior: presets with an interior best range.
        others: the other presets, each with its finding.
    """

    question: str
    interior: Sequence[str]
    others: Sequence[tuple[str, Finding]]

    def __str__(self) -> str:
        number = len(self.interior) + len(self.others)
        if not self.others:
            return f"yes: {', '.join(self.interior)}"
        named = "; ".join(f"{name} ({finding})" for name, finding in self.others)
        if not self.interior:
            return f"not shown: {named}"
        return f"in {len(self.interior)} of {number}: {', '.join(self.interior)}; not shown for {named}"


def answers(results: RobustnessResults, symbol: str) -> list[Answer]:
    """Return the answers to all questions for one objective."""
    found = []
    for question in QUESTIONS:
        rows = [
            (row.name, row.outcomes[symbol].finding) for row in results.presets if row.question == question
        ]
        interior = [name for name, finding in rows if finding is Finding.INTERIOR]
        others = [(name, finding) for name, finding in rows if finding is not Finding.INTERIOR]
        if rows:
            found.append(Answer(question, interior, others))
    return found


def markdown_page(results: RobustnessResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the picture in the folder ``figures``."""
    template = templates("studies.robustness").get_template("robustness.md")
    rendered: str = template.render(
        results=results,
        answers={symbol: answers(results, symbol) for symbol in results.presets[0].outcomes},
        grids=sorted({str(row.grid) for row in results.presets}),
        picture=path_from(page, figures / f"{FIGURE}.png"),
        rule=RULE,
        place=_place,
    )
    return rendered


def _place(best: Estimate, unit: str) -> str:
    return f"{best.mean:g} [{best.low:g}, {best.high:g}] {unit}"


def _preset(row: dict[str, Any]) -> PresetResult:
    outcomes = {symbol: _outcome(fields) for symbol, fields in row["outcomes"].items()}
    grid = Grid(row["grid"]["unit"], tuple(row["grid"]["actions"]))
    return PresetResult(**{**row, "grid": grid, "outcomes": outcomes})


def _outcome(fields: dict[str, Any]) -> Outcome:
    curve = tuple(Estimate(**point) for point in fields.pop("curve"))
    return Outcome(**{name: Estimate(**value) for name, value in fields.items()}, curve=curve)
