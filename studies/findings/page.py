"""The pages of results and details and the README's table, made from the files of the studies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure
from training.outputs import CURVE_FLOCKS

from flockesc_env.common.stats import CONFIDENCE
from flockesc_env.episodes.splits import FLOCKS_PER_RUN, HELD_OUT, TRAINING, TUNING
from flockesc_env.tasks.statistics import profile
from studies.findings import figures
from studies.findings.cells import LOSSES_FILE, read_cells
from studies.findings.coverage import COVERAGE_FILE, NUM_FLOCKS, NUM_TRIALS, SEEDS, read_coverage
from studies.findings.dispersal import DISPERSAL_FLOCKS
from studies.findings.information import INFORMATION_FILE, STEPS_PER_ACTION, UNAWARE_RANGE, draw_information
from studies.findings.kinds import TRAINED, Kind
from studies.findings.listening import LISTENING_FILE, LISTENING_FLOCKS, WATCHED, draw_listening
from studies.findings.loss_tables import loss_tables
from studies.findings.named import numbers
from studies.findings.names import KNOWLEDGE, setting_title
from studies.findings.one_agent import AGENT_FILE, draw_agent
from studies.findings.questions import QUESTIONS
from studies.findings.references import NUM_SEGMENTS, PLANNED_STEPS, SEGMENT_STEPS
from studies.findings.results import BEST_FIXED, FIGURES, ORACLE, load_studies
from studies.findings.story import story
from studies.findings.summary import LENDERS, Summary, losses_first, outcomes, summarize
from studies.findings.tables import ablation_table, transfer_tables, versions
from studies.pages import path_from, render
from studies.study import Pages

DETAILS = "results-details.md"
"""The page beside that of results: tables per setting, ablation, transfer, throughput."""

CREDIT = "per-agent-visible"
"""The setting that compares rewards."""

IN_README = ("per-agent-local", "per-agent-visible-derived", "shared", "per-agent-visible")
"""The settings in the README's table."""


_PROTOCOL = {
    "best_fixed": BEST_FIXED,
    "oracle": ORACLE,
    "planner_steps": PLANNED_STEPS,
    "segments": NUM_SEGMENTS,
    "segment_steps": SEGMENT_STEPS,
    "confidence": CONFIDENCE,
    "tuning": TUNING,
    "held_out": HELD_OUT,
    "training": TRAINING,
    "flocks_per_run": FLOCKS_PER_RUN,
}


def markdown_page(summaries: Sequence[Summary], results: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with pictures in the folder of the results."""
    coverage, ordered = results / COVERAGE_FILE, losses_first(summaries)
    return render(
        "findings/findings.md",
        summaries=summaries,
        pictures=path_from(page, results / FIGURES),
        shown={file.name for file in (results / FIGURES).glob("*.*")},
        watched=[name for name in WATCHED if (results / name / LISTENING_FILE).is_file()],
        details=DETAILS,
        dispersal_flocks=DISPERSAL_FLOCKS,
        losses=loss_tables(read_cells(results / LOSSES_FILE), summaries),
        **numbers(summaries, results),
        unaware_range=UNAWARE_RANGE,
        steps_per_action=STEPS_PER_ACTION,
        listening_flocks=LISTENING_FLOCKS,
        missing=[name for name in QUESTIONS if name not in {row.study.setting for row in summaries}],
        knowledge=KNOWLEDGE,
        losses_first=ordered,
        outcomes=outcomes(ordered),
        untaught=[row.study.setting for row in ordered if Kind.RULE in row.best and not row.learned],
        kinds=list(Kind),
        trained=TRAINED,
        curve_flocks=CURVE_FLOCKS,
        coverage=read_coverage(coverage) if coverage.is_file() else None,
        coverage_flocks=NUM_FLOCKS,
        coverage_trials=NUM_TRIALS,
        coverage_seeds=SEEDS,
        **_PROTOCOL,
    )


def details_page(summaries: Sequence[Summary], results: Path, page: Path) -> str:
    """Return the page of details as Markdown; arguments as those of ``markdown_page``."""
    cells = read_cells(results / LOSSES_FILE)
    text = render(
        "findings/details.md",
        summaries=summaries,
        pictures=path_from(page, results / FIGURES),
        credit=[summary for summary in summaries if summary.study.setting == CREDIT],
        lenders=LENDERS,
        ablation=ablation_table(summaries),
        transfers=transfer_tables(cells, summaries),
        losses=loss_tables(cells, summaries),
        versions=versions(summaries),
        **_PROTOCOL,
    )
    return text.rstrip() + "\n"


def readme_table(summaries: Sequence[Summary]) -> str:
    """Return the README's table, one row per setting of ``IN_README``, as Markdown."""
    compared = [row for row in losses_first(summaries) if row.learned in row.over_rule]
    rows = [row for row in compared if row.study.setting in IN_README]
    text = render(
        "findings/readme_table.md", rows=rows, title=setting_title, best_fixed=BEST_FIXED, rule=Kind.RULE
    )
    return text.strip()


def _figures(summaries: Sequence[Summary]) -> dict[str, Figure]:
    """Return the figures of all settings, and of single measurements that have a file."""
    studies = [summary.study for summary in summaries]
    results, shown = studies[0].folder.parent, figures.shown_studies(studies)
    profiles = {
        study.setting: {
            name: profile(study.values(name), figures.thresholds(study)) for name in figures.profiled(study)
        }
        for study in shown
    }
    told = story(summaries)
    drawn = {
        **({"story": told} if told else {}),
        "gains": figures.gains(summaries),
        "learning_curves": figures.learning_curves(shown),
        "performance_profiles": figures.performance_profiles(shown, profiles),
    }
    measured = {
        "information": (results / INFORMATION_FILE, draw_information),
        "one_agent": (results / AGENT_FILE, draw_agent),
        **{name: (results / name / LISTENING_FILE, draw_listening) for name in WATCHED},
    }
    drawn |= {name: draw(file) for name, (file, draw) in measured.items() if file.is_file()}
    return {f"{FIGURES}/{name}": figure for name, figure in drawn.items()}


def _pages(summaries: Sequence[Summary], results: Path, page: Path) -> dict[Path, str]:
    details = page.with_name(DETAILS)
    return {
        page: markdown_page(summaries, results, page),
        details: details_page(summaries, results, details),
    }


LEARNED = Pages(
    load=lambda results: summarize(load_studies(results)),
    figures=_figures,
    pages=_pages,
)
