"""The bandit over ranges as a study. Needs the ``train`` extra."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from studies.learned.results import load_study
from studies.measurements import Runner
from studies.related.page import BANDIT_FILE, RelatedResults, markdown_page
from studies.related.within_episode import across, within_episode
from studies.study import RESULTS_FILE, Study
from training.versions import versions

SHARED: dict[str, str] = {"J_mean": "shared", "J_min": "shared-minimum"}
"""Study of one range for the flock, by objective."""

ACROSS_EPISODES, ACROSS_RUNS = 400, 20


def _measure(learned: Path, runner: Runner, output: Path) -> None:
    within, tables = {}, []
    for symbol, setting in SHARED.items():
        within[symbol], table = within_episode(symbol, load_study(learned / setting), runner)
        tables.append(table.with_columns(pl.lit(setting).alias("setting")))
    results = RelatedResults(
        command="python -m studies related",
        within=within,
        across=across(ACROSS_EPISODES, ACROSS_RUNS, runner),
        versions=versions(),
    )
    write_table(pl.concat(tables), output / BANDIT_FILE)
    write_text(output / RESULTS_FILE, results.to_json())


RELATED = Study(
    measure=_measure,
    load=RelatedResults.load,
    figures=lambda _: {},
    pages=lambda results, output, page: {page: markdown_page(results, output, page)},
)
