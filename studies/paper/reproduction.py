"""The reproduction of the paper as a study. Needs the ``analysis`` extra."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

from flockesc_env.cli.output import note
from flockesc_env.common.files import write_text
from studies.measurements import Runner
from studies.paper import realizations
from studies.paper.anatomy import anatomy_table
from studies.paper.figures import draw_figures
from studies.paper.flock_claims import by_range, flock_claims
from studies.paper.line_claims import edge_claim, line_claims
from studies.paper.mechanism_claims import force_table, mechanism_claims
from studies.paper.page import PaperResults, html_page, markdown_page
from studies.paper.plan import ANATOMIES, Trials, measurements
from studies.paper.theory_claims import theory_claims
from studies.study import RESULTS_FILE, Study


def _measure(trials: Trials, runner: Runner, output: Path) -> None:
    """Measure all claims; write the results and the figures, which show more than the results hold."""
    measured = runner.measure(measurements(trials))
    note("measured; statistics and figures take another two minutes")
    claims = (
        *theory_claims(measured),
        *line_claims(measured),
        *flock_claims(measured),
        edge_claim(measured),
        *mechanism_claims(measured),
    )
    results = PaperResults(
        trials=trials,
        line_seed=realizations.line_seed(measured["free line"]),
        flock_seed=realizations.flock_seed(measured["curves"], measured["grid flock"]),
        claims=claims,
        by_range=by_range(measured["grid flock"]),
        tables={
            "force": force_table(measured),
            **{name: anatomy_table(measured[name]) for name in ANATOMIES},
        },
        versions={name: version(name) for name in ("flockesc-env", "numpy", "scipy")},
    )
    draw_figures(output, measured)
    write_text(output / RESULTS_FILE, results.to_json())


def _pages(results: PaperResults, output: Path, page: Path) -> dict[Path, str]:
    return {page: markdown_page(results, output, page), output / "paper.html": html_page(results, output)}


PAPER = Study(measure=_measure, load=PaperResults.load, figures=lambda _: {}, pages=_pages)
