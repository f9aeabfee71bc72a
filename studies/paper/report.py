"""The reproduction of the paper as a study: its results, and their report."""

import re
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from flockesc_env.cli.output import note
from flockesc_env.common.stats import Estimate
from studies.measurements import Runner
from studies.paper import plan
from studies.paper.claims import MOST, Claim, Quantity, Verdict
from studies.paper.figures import draw_figures, flock_seed, line_seed
from studies.paper.flock_claims import RangeRow, by_range, flock_claims
from studies.paper.line_claims import edge_claim, line_claims, theory_claims
from studies.paper.mechanism_claims import SECTION, force_table, mechanism_claims
from studies.paper.plan import Trials
from studies.study import Results, Study, template

_SECTIONS = {
    "III": "Theory of the line (Section III)",
    "IV": "Line (Section IV)",
    "V": "Flock (Sections V and VI)",
    SECTION: "Mechanism (Sections I and V)",
}
"""Titles by what the places of their claims start with."""


@dataclass(frozen=True)
class PaperResults(Results):
    """Everything that the report shows.

    The seeds are those of the line of Figures 3 and 4 and of the flock of Figures 6 to 10. ``tables`` holds
    columns by table and name, an estimate per range of ``CONTROL_GRID``: ``force_table`` under ``"force"``.
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

    def at(self, table: str, column: str, rho: float, scale: float = 1.0) -> Estimate:
        """Return an estimate of a table under a range, multiplied by ``scale``."""
        value = self.tables[table][column][plan.CONTROL_GRID.index(rho)]
        return Estimate(scale * value.mean, scale * value.low, scale * value.high)


def measure(runner: Runner, output: Path, trials: Trials) -> PaperResults:
    """Measure all claims; write the figures, which show more than the results hold."""
    measured = runner.run(plan.measurements(trials), "Measuring")
    note("measured; statistics and figures take another two minutes")
    draw_figures(output, measured)
    return PaperResults(
        trials=trials,
        line_seed=line_seed(measured),
        flock_seed=flock_seed(measured),
        claims=(
            *theory_claims(measured),
            *line_claims(measured),
            *flock_claims(measured),
            edge_claim(measured),
            *mechanism_claims(measured),
        ),
        by_range=by_range(measured["grid flock"]),
        tables={"force": force_table(measured)},
        versions={name: version(name) for name in ("flockesc-env", "numpy", "scipy")},
    )


def report(results: PaperResults) -> str:
    """Return the report as Markdown."""
    sections: dict[str, list[tuple[int, Claim]]] = {}
    for number, row in enumerate(results.claims, start=1):
        title = next(title for start, title in _SECTIONS.items() if row.where.startswith(start))
        sections.setdefault(title, []).append((number, row))
    judged = [(row.judgment.verdict, row.is_reading) for row in results.claims]
    unclear = " (sample too small to tell)"
    return template("paper/templates/paper.md", globals()).render(
        results=results,
        sections=sections,
        most=MOST,
        counts={each: [judged.count((each, reading)) for reading in (False, True)] for each in Verdict},
        mark=lambda judgment: judgment.verdict.value + ("" if judgment.is_clear else unclear),
    )


def figure_link(where: str) -> str:
    """Link the figure that a place of the paper names: "V, Fig. 9a" to the picture of Figure 9."""
    if where == "VI":
        return "[VI](#edge)"
    return re.sub(r"Fig\. (\d+)([a-d]?)", r"[Fig. \1\2](#figure_\1)", where)


PAPER = Study(measure=measure, load=PaperResults.load, figures=lambda _: {}, report=report)
