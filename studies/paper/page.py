"""The page of claims and measurements, as Markdown and as one HTML file."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from markdown import Markdown

from flockesc_env.common.stats import Estimate
from studies.pages import path_from, signed, templates
from studies.paper.claims import MOST, Claim, Judgment, Quantity, RangeRow, Verdict
from studies.paper.equations import EQUATIONS
from studies.paper.mechanism_claims import SECTION
from studies.paper.plan import CAPTURE_RADIUS, CONTROL_GRID, Trials
from studies.paper.realizations import FLOCK_RULE, LINE_RULE

RESULTS_FILE = "results.json"
ROOT = Path(__file__).parents[2]
MIDDLE = 12.0
"""Range in m at which the page explains J_mean."""

_MECHANISM = "Mechanism (Sections I and V)"
_UNCLEAR = " (sample too small to tell)"


@dataclasses.dataclass(frozen=True)
class PaperResults:
    """Everything that the page shows.

    Attributes:
        trials: how many flocks and lines.
        line_seed: the line of Figures 3 and 4.
        flock_seed: the flock of Figures 6 to 10.
        claims: the rows.
        by_range: objectives of some fixed ranges.
        tables: columns of estimates by table and column; an estimate per range of ``CONTROL_GRID``. Table
            ``force`` has the objectives under the escape forces of the control, the others, keys of
            ``ANATOMIES``, what ``anatomy_table`` returns.
        versions: of the packages.
    """

    trials: Trials
    line_seed: int
    flock_seed: int
    claims: tuple[Claim, ...]
    by_range: tuple[RangeRow, ...]
    tables: dict[str, dict[str, tuple[Estimate, ...]]]
    versions: dict[str, str]

    def measured(self, where: str, what: str) -> Quantity:
        """Return the measured quantity of the claims at a place of the paper.

        Raises:
            KeyError: if there is no such quantity, or if there are different ones.
        """
        found = {
            quantity
            for claim in self.claims
            if claim.where == where
            for quantity in claim.measured
            if quantity.what == what
        }
        if len(found) != 1:
            raise KeyError(f"{len(found)} quantities {what!r} at {where!r}")
        return found.pop()

    def at(self, table: str, column: str, rho: float) -> Estimate:
        """Return an estimate of a table under a range."""
        return self.tables[table][column][CONTROL_GRID.index(rho)]

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
            tables={
                table: {name: tuple(Estimate(**row) for row in rows) for name, rows in columns.items()}
                for table, columns in fields["tables"].items()
            },
            versions=fields["versions"],
        )


def markdown_page(results: PaperResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the pictures in the folder ``figures``."""
    return _render(results, page, lambda name: f"{path_from(page, figures)}/{name}.png", str)


def html_page(results: PaperResults, figures: Path) -> str:
    """Return the page as one HTML file in ``figures`` that holds its pictures."""

    def embedded(name: str) -> str:
        picture = base64.b64encode((figures / f"{name}.png").read_bytes()).decode()
        return f"data:image/png;base64,{picture}"

    def colored(verdict: str) -> str:
        return f'<span class="verdict {verdict.replace(" ", "-")}">{verdict}</span>'

    text = _render(results, figures / "paper.html", embedded, colored)
    converter = Markdown(
        extensions=["tables", "fenced_code", "toc"], extension_configs={"toc": {"toc_depth": "2-3"}}
    )
    body = converter.convert(text)
    page: str = templates("studies.paper").get_template("page.html").render(body=body, contents=converter.toc)
    return page


def _render(
    results: PaperResults, page: Path, picture: Callable[[str], str], mark: Callable[[str], str]
) -> str:
    numbered = list(enumerate(results.claims, start=1))
    sections = {
        title: [(number, row) for number, row in numbered if _section(row) == title]
        for title in (
            "Theory of the line (Section III)",
            "Line (Section IV)",
            "Flock (Sections V and VI)",
            _MECHANISM,
        )
    }
    counts = {
        verdict.value: [
            sum(row.judgment.verdict is verdict and row.is_reading is is_reading for row in results.claims)
            for is_reading in (False, True)
        ]
        for verdict in Verdict
    }
    rendered: str = (
        templates("studies.paper")
        .get_template("page.md")
        .render(
            results=results,
            sections=sections,
            counts=counts,
            picture=picture,
            mark=lambda judgment: mark(judgment.verdict.value) + ("" if judgment.is_clear else _UNCLEAR),
            figure_link=_figure_link,
            equations=EQUATIONS,
            root=path_from(page, ROOT),
            most=MOST,
            measured=results.measured,
            at=results.at,
            grid=CONTROL_GRID,
            capture_radius=CAPTURE_RADIUS,
            middle=MIDDLE,
            signed=signed,
            cell=lambda *place: _scaled(results.at(*place[:-1]), place[-1]),
            line_rule=LINE_RULE,
            flock_rule=FLOCK_RULE,
        )
    )
    return rendered


def _section(row: Claim) -> str:
    if row.where.startswith(SECTION):
        return _MECHANISM
    if row.where.startswith("III"):
        return "Theory of the line (Section III)"
    return "Line (Section IV)" if row.where.startswith("IV") else "Flock (Sections V and VI)"


def _scaled(value: Estimate, scale: float) -> Estimate:
    return Estimate(scale * value.mean, scale * value.low, scale * value.high)


def _figure_link(where: str) -> str:
    """Link the figure that a place of the paper names: "V, Fig. 9a" to the picture of Figure 9."""
    if where == "VI":
        return "[VI](#edge)"
    return re.sub(r"Fig\. (\d+)([a-d]?)", r"[Fig. \1\2](#figure_\1)", where)


def _claim(row: dict[str, Any]) -> Claim:
    measured = tuple(
        Quantity(**{**figure, "value": Estimate(**figure["value"])}) for figure in row["measured"]
    )
    found = row["judgment"]
    judgment = Judgment(Verdict(found["verdict"]), Estimate(**found["share"]), found["is_clear"])
    return Claim(**{**row, "measured": measured, "judgment": judgment})


def _range_row(interaction_range: float, **estimates: dict[str, float]) -> RangeRow:
    return RangeRow(interaction_range, **{name: Estimate(**value) for name, value in estimates.items()})
