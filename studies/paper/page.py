"""The page of claims and measurements, as Markdown and as one HTML file."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from markdown import Markdown

from flockesc_env.common.stats import Estimate
from studies.pages import path_from, render, signed
from studies.paper.claims import MOST, Claim, Quantity, RangeRow, Verdict
from studies.paper.equations import EQUATIONS
from studies.paper.mechanism_claims import SECTION
from studies.paper.plan import CAPTURE_RADIUS, CONTROL_GRID, Trials
from studies.paper.realizations import FLOCK_RULE, LINE_RULE
from studies.study import Results

ROOT = Path(__file__).parents[2]
MIDDLE = 12.0
"""Range in m at which the page explains J_mean."""

_SECTIONS = {
    "III": "Theory of the line (Section III)",
    "IV": "Line (Section IV)",
    "V": "Flock (Sections V and VI)",
    SECTION: "Mechanism (Sections I and V)",
}
"""Titles by what the places of their claims start with."""

_UNCLEAR = " (sample too small to tell)"


@dataclass(frozen=True)
class PaperResults(Results):
    """Everything that the page shows.

    The seeds are those of the line of Figures 3 and 4 and of the flock of Figures 6 to 10. ``tables`` holds
    columns by table and name, an estimate per range of ``CONTROL_GRID``: ``force_table`` under ``"force"``,
    and ``anatomy_table`` of each flock under the keys of ``ANATOMIES``.
    """

    trials: Trials
    line_seed: int
    flock_seed: int
    claims: tuple[Claim, ...]
    by_range: tuple[RangeRow, ...]
    tables: dict[str, dict[str, tuple[Estimate, ...]]]
    versions: dict[str, str]

    def measured(self, where: str, what: str) -> Quantity:
        """Return the only measured quantity of this name at a place of the paper."""
        rows = [claim.measured for claim in self.claims if claim.where == where]
        found = {quantity for row in rows for quantity in row if quantity.what == what}
        if len(found) != 1:
            raise KeyError(f"{len(found)} quantities {what!r} at {where!r}")
        return found.pop()

    def at(self, table: str, column: str, rho: float) -> Estimate:
        """Return an estimate of a table under a range."""
        return self.tables[table][column][CONTROL_GRID.index(rho)]


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
    return render("paper/page.html", body=body, contents=converter.toc)


def _render(
    results: PaperResults, page: Path, picture: Callable[[str], str], mark: Callable[[str], str]
) -> str:
    sections: dict[str, list[tuple[int, Claim]]] = {title: [] for title in _SECTIONS.values()}
    for number, row in enumerate(results.claims, start=1):
        sections[_section(row)].append((number, row))
    counts = {
        verdict.value: [
            sum(row.judgment.verdict is verdict and row.is_reading is is_reading for row in results.claims)
            for is_reading in (False, True)
        ]
        for verdict in Verdict
    }
    return render(
        "paper/page.md",
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


def _section(row: Claim) -> str:
    return next(title for start, title in _SECTIONS.items() if row.where.startswith(start))


def _scaled(value: Estimate, scale: float) -> Estimate:
    return Estimate(scale * value.mean, scale * value.low, scale * value.high)


def _figure_link(where: str) -> str:
    """Link the figure that a place of the paper names: "V, Fig. 9a" to the picture of Figure 9."""
    if where == "VI":
        return "[VI](#edge)"
    return re.sub(r"Fig\. (\d+)([a-d]?)", r"[Fig. \1\2](#figure_\1)", where)
