"""The page: every claim beside its measurement, as Markdown and as one HTML file without links to others."""

from __future__ import annotations

import base64
import dataclasses
import json
import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from markdown import markdown

from flockesc_env.common.stats import Estimate
from studies.pages import templates
from studies.paper.claims import MOST, Claim, Quantity, RangeRow, Verdict
from studies.paper.plan import Trials
from studies.paper.realizations import FLOCK_RULE, LINE_RULE

RESULTS_FILE = "results.json"


@dataclasses.dataclass(frozen=True)
class PaperResults:
    """All that the page is made from.

    Attributes:
        trials: how many flocks and lines.
        line_seed: the line of Figures 3 and 4.
        flock_seed: the flock of Figures 6 to 10.
        claims: the rows.
        by_range: what fixed ranges give.
        versions: of the packages that they were computed with.
    """

    trials: Trials
    line_seed: int
    flock_seed: int
    claims: tuple[Claim, ...]
    by_range: tuple[RangeRow, ...]
    versions: dict[str, str]

    def to_json(self) -> str:
        """Return the results as a JSON document; equal results give equal bytes."""
        return json.dumps(dataclasses.asdict(self), indent=1) + "\n"

    @classmethod
    def from_json(cls, document: str) -> PaperResults:
        """Build results from their JSON document."""
        fields = json.loads(document)
        return cls(
            trials=Trials(**fields["trials"]),
            line_seed=fields["line_seed"],
            flock_seed=fields["flock_seed"],
            claims=tuple(_claim(row) for row in fields["claims"]),
            by_range=tuple(_range_row(**row) for row in fields["by_range"]),
            versions=fields["versions"],
        )


def markdown_page(results: PaperResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the pictures in the folder ``figures``."""
    folder = Path(os.path.relpath(figures.resolve(), page.resolve().parent))
    return _render("page.md", results, lambda name: (folder / f"{name}.png").as_posix())


def html_page(results: PaperResults, figures: Path) -> str:
    """Return the page as one HTML file that holds its pictures."""

    def embedded(name: str) -> str:
        picture = base64.b64encode((figures / f"{name}.png").read_bytes()).decode()
        return f"data:image/png;base64,{picture}"

    body = markdown(_render("page.md", results, embedded), extensions=["tables", "fenced_code"])
    return templates("studies.paper").get_template("page.html").render(body=body)


def _render(template: str, results: PaperResults, picture: Callable[[str], str]) -> str:
    sections = {
        "Theory of the line (Section III)": [row for row in results.claims if row.where.startswith("III")],
        "Line (Section IV)": [row for row in results.claims if row.where.startswith("IV")],
        "Flock (Sections V and VI)": [row for row in results.claims if row.where.startswith("V")],
    }
    counts = Counter(row.verdict for row in results.claims)
    page: str = (
        templates("studies.paper")
        .get_template(template)
        .render(
            results=results,
            sections=sections,
            counts={verdict.value: counts[verdict] for verdict in Verdict},
            picture=picture,
            most=MOST,
            line_rule=LINE_RULE,
            flock_rule=FLOCK_RULE,
        )
    )
    return page


def _claim(row: dict[str, Any]) -> Claim:
    measured = tuple(
        Quantity(**{**figure, "value": Estimate(**figure["value"])}) for figure in row["measured"]
    )
    return Claim(**{**row, "measured": measured, "verdict": Verdict(row["verdict"])})


def _range_row(interaction_range: float, **estimates: dict[str, float]) -> RangeRow:
    return RangeRow(interaction_range, **{name: Estimate(**value) for name, value in estimates.items()})
