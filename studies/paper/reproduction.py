"""From measurements to results, figures and page. Needs the ``analysis`` extra."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

from flockesc_env.cli.output import note
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Backend, Cache
from studies.measurements import measure
from studies.paper import realizations
from studies.paper.anatomy import anatomy_table
from studies.paper.figures import draw_figures
from studies.paper.flock_claims import by_range, flock_claims
from studies.paper.line_claims import edge_claim, line_claims
from studies.paper.mechanism_claims import force_table, mechanism_claims
from studies.paper.page import RESULTS_FILE, PaperResults, html_page, markdown_page
from studies.paper.plan import ANATOMIES, Trials, measurements
from studies.paper.theory_claims import theory_claims

_PACKAGES = ("flockesc-env", "numpy", "scipy")


def reproduce(
    output: Path,
    trials: Trials,
    backend: Backend,
    *,
    cache: Path | None = None,
    page: Path | None = None,
    progress: bool = False,
) -> PaperResults:
    """Measure all claims; write the results, the figures and the page.

    Called again after an interrupt, it continues where it stopped and ends with the same bytes.

    Args:
        output: folder of ``results.json``, the figures (PNG and SVG) and ``paper.html``.
        trials: how many flocks and lines.
        backend: where the measurements run.
        cache: folder of finished jobs; default: ``cache`` in ``output``.
        page: where the Markdown page goes; default: ``paper.md`` in ``output``.
        progress: whether to show the progress bar even if stderr is not a terminal.

    Raises:
        JobError: if measurements failed.
    """
    output.mkdir(parents=True, exist_ok=True)
    measured = measure(measurements(trials), Cache(cache or output / "cache"), backend, progress=progress)
    note("measured; statistics and figures take another two minutes")
    line = realizations.line_seed(measured["free line"])
    flock = realizations.flock_seed(measured["curves"], measured["grid flock"])
    claims = (
        *theory_claims(measured),
        *line_claims(measured),
        *flock_claims(measured),
        edge_claim(measured),
        *mechanism_claims(measured),
    )
    tables = {"force": force_table(measured)} | {name: anatomy_table(measured[name]) for name in ANATOMIES}
    versions = {name: version(name) for name in _PACKAGES}
    results = PaperResults(trials, line, flock, claims, by_range(measured["grid flock"]), tables, versions)
    draw_figures(output, measured)
    markdown = page or output / "paper.md"
    write_text(output / RESULTS_FILE, results.to_json())
    write_text(markdown, markdown_page(results, output, markdown))
    write_text(output / "paper.html", html_page(results, output))
    return results
