"""The page: a row per world, and what the rows say, made from the results file alone."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from flockesc_env.common.stats import Estimate
from studies.paper.page import environment
from studies.robustness.findings import RULE, Finding, Outcome
from studies.robustness.plan import Grid
from studies.robustness.questions import QUESTIONS

RESULTS_FILE = "results.json"
FIGURE = "worlds"


@dataclasses.dataclass(frozen=True)
class World:
    """One row.

    Attributes:
        name: of the preset.
        description: of the preset.
        question: what it differs in from the paper, a key of ``QUESTIONS``.
        grid: the actions that were tried.
        outcomes: by the objectives' symbols.
    """

    name: str
    description: str
    question: str
    grid: Grid
    outcomes: dict[str, Outcome]


@dataclasses.dataclass(frozen=True)
class Results:
    """All that page and figure are made from.

    Attributes:
        command: that gives these results.
        num_flocks: flocks in each half: ranges are chosen on the seeds from 0, measured on those from here.
        worlds: the rows.
        versions: of Python and of the packages that they were computed with.
    """

    command: str
    num_flocks: int
    worlds: tuple[World, ...]
    versions: dict[str, str]

    def to_json(self) -> str:
        """Return the results as a JSON document; equal results give equal bytes."""
        return json.dumps(dataclasses.asdict(self), indent=1) + "\n"

    @classmethod
    def from_json(cls, document: str) -> Results:
        """Build results from their JSON document."""
        fields = json.loads(document)
        return cls(**{**fields, "worlds": tuple(_world(row) for row in fields["worlds"])})


@dataclasses.dataclass(frozen=True)
class Answer:
    """What the worlds of one question say.

    Attributes:
        question: a key of ``QUESTIONS``.
        interior: worlds whose best range is interior.
        others: the other worlds, each with what was found in place of that.
    """

    question: str
    interior: Sequence[str]
    others: Sequence[tuple[str, Finding]]

    def __str__(self) -> str:
        number = len(self.interior) + len(self.others)
        if not self.others:
            return f"yes: {', '.join(self.interior)}"
        told = "; ".join(f"{name} ({finding})" for name, finding in self.others)
        if not self.interior:
            return f"not shown: {told}"
        return f"in {len(self.interior)} of {number}: {', '.join(self.interior)}; not shown for {told}"


def answers(results: Results, symbol: str) -> list[Answer]:
    """Return what the worlds say about one objective, by question."""
    found = []
    for question in QUESTIONS:
        rows = [
            (row.name, row.outcomes[symbol].finding) for row in results.worlds if row.question == question
        ]
        interior = [name for name, finding in rows if finding is Finding.INTERIOR]
        others = [(name, finding) for name, finding in rows if finding is not Finding.INTERIOR]
        if rows:
            found.append(Answer(question, interior, others))
    return found


def markdown_page(results: Results, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the picture in the folder ``figures``."""
    folder = Path(os.path.relpath(figures.resolve(), page.resolve().parent))
    template = environment("studies.robustness").get_template("worlds.md")
    rendered: str = template.render(
        results=results,
        answers={symbol: answers(results, symbol) for symbol in results.worlds[0].outcomes},
        grids=sorted({str(row.grid) for row in results.worlds}),
        picture=(folder / f"{FIGURE}.png").as_posix(),
        rule=RULE,
        place=_place,
    )
    return rendered


def _place(best: Estimate, unit: str) -> str:
    return f"{best.mean:g} [{best.low:g}, {best.high:g}] {unit}"


def _world(row: dict[str, Any]) -> World:
    outcomes = {symbol: _outcome(fields) for symbol, fields in row["outcomes"].items()}
    grid = Grid(row["grid"]["unit"], tuple(row["grid"]["actions"]))
    return World(**{**row, "grid": grid, "outcomes": outcomes})


def _outcome(fields: dict[str, Any]) -> Outcome:
    curve = tuple(Estimate(**point) for point in fields.pop("curve"))
    return Outcome(**{name: Estimate(**value) for name, value in fields.items()}, curve=curve)
