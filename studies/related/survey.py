"""Run the related studies: measurements, results, figure and page. Needs the ``train`` extra."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from flockesc_env.jobs import Backend, Cache
from studies.learned.results import load_study
from studies.measurements import run_groups
from studies.related.attack_speed import attack_jobs, attack_results
from studies.related.figure import attack_figure
from studies.related.page import BANDIT_FILE, FIGURE, RESULTS_FILE, RelatedResults, markdown_page
from studies.related.within_episode import across, within_episode
from training.figure_style import save_figure
from training.versions import versions

SHARED: dict[str, str] = {"J_mean": "shared", "J_min": "shared-minimum"}
"""Study of one range for the flock, by objective."""

ACROSS_EPISODES, ACROSS_RUNS = 400, 20


def survey(
    output: Path,
    num_flocks: int,
    learned: Path,
    page: Path,
    backend: Backend,
    *,
    cache: Path | None = None,
    progress: bool = False,
) -> RelatedResults:
    """Measure everything; write the results, the figure and the page.

    Called again after an interrupt, it continues where it stopped and ends with the same bytes.

    Args:
        output: folder of ``results.json``, ``bandit.parquet`` and the figure.
        num_flocks: held-out flocks per speed of the predator; half as many tuning flocks.
        learned: folder of the studies of learned ranges.
        page: file of the Markdown page.
        backend: where the measurements run.
        cache: folder of finished jobs; default: ``cache`` in ``output``.
        progress: whether to show the progress bar even if stderr is not a terminal.

    Raises:
        JobError: if measurements failed.
        RecordError: if a study of learned ranges is incomplete.
    """
    kept = Cache(cache or output / "cache")
    output.mkdir(parents=True, exist_ok=True)
    measured = run_groups(
        attack_jobs(num_flocks), kept, backend, title="Speeds of the predator", progress=progress
    )
    within, tables = {}, []
    for symbol in SHARED:
        study = load_study(learned / SHARED[symbol])
        within[symbol], rows = within_episode(symbol, study, kept, backend, progress=progress)
        tables.append(rows.with_columns(pl.lit(study.setting).alias("setting")))
    results = RelatedResults(
        command=f"python -m studies related --num-flocks {num_flocks}",
        attack=attack_results(measured),
        within=within,
        across=across(ACROSS_EPISODES, ACROSS_RUNS, kept, backend),
        versions=versions(),
    )
    write_table(pl.concat(tables), output / BANDIT_FILE)
    write_text(output / RESULTS_FILE, results.to_json())
    write_related_page(output, page)
    return results


def write_related_page(output: Path, page: Path) -> None:
    """Write the figure and the page from the results in a folder."""
    results = RelatedResults.from_json((output / RESULTS_FILE).read_text())
    save_figure(attack_figure(results.attack), output / FIGURE, ("png",))
    page.parent.mkdir(parents=True, exist_ok=True)
    write_text(page, markdown_page(results, output, page))
