"""The related studies as one study. Needs the ``train`` extra."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import polars as pl

from flockesc_env.common.array_files import write_table
from flockesc_env.common.files import write_text
from studies.learned.results import load_study
from studies.measurements import Runner
from studies.related.attack_speed import attack_jobs, attack_results
from studies.related.figure import attack_figure
from studies.related.page import BANDIT_FILE, FIGURE, RelatedResults, markdown_page
from studies.related.within_episode import across, within_episode
from studies.study import RESULTS_FILE, Study
from training.versions import versions

SHARED: dict[str, str] = {"J_mean": "shared", "J_min": "shared-minimum"}
"""Study of one range for the flock, by objective."""

ACROSS_EPISODES, ACROSS_RUNS = 400, 20


@dataclass(frozen=True)
class RelatedOptions:
    """Held-out flocks per speed (half as many tuning flocks), and the folder of learned ranges."""

    num_flocks: int
    learned: Path


def _measure(options: RelatedOptions, runner: Runner, output: Path) -> None:
    measured = runner.groups(attack_jobs(options.num_flocks), "Speeds of the predator")
    within, tables = {}, []
    for symbol, setting in SHARED.items():
        within[symbol], table = within_episode(symbol, load_study(options.learned / setting), runner)
        tables.append(table.with_columns(pl.lit(setting).alias("setting")))
    results = RelatedResults(
        command=f"python -m studies related --num-flocks {options.num_flocks}",
        attack=attack_results(measured),
        within=within,
        across=across(ACROSS_EPISODES, ACROSS_RUNS, runner),
        versions=versions(),
    )
    write_table(pl.concat(tables), output / BANDIT_FILE)
    write_text(output / RESULTS_FILE, results.to_json())


RELATED = Study(
    measure=_measure,
    load=RelatedResults.load,
    figures=lambda results: {FIGURE: attack_figure(results.attack)},
    pages=lambda results, output, page: {page: markdown_page(results, output, page)},
)
