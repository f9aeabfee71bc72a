"""The results page and the README's table, made from the files of the studies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from flockesc_env.common.stats import CONFIDENCE
from studies.forest import Group
from studies.learned import figures
from studies.learned.aggregate import RESAMPLES, profile
from studies.learned.ceilings import ceilings
from studies.learned.information import INFORMATION_FILE, STEPS_PER_ACTION, UNAWARE_RANGE, draw_information
from studies.learned.leaderboard import PAGE as LEADERBOARD
from studies.learned.leaderboard import leaderboard_page
from studies.learned.listening import LISTENING_FILE, LISTENING_FLOCKS, draw_listening
from studies.learned.names import KNOWLEDGE, setting_title
from studies.learned.questions import QUESTIONS
from studies.learned.references import NUM_SEGMENTS, PLANNED_STEPS, SEGMENT_STEPS
from studies.learned.results import BEST_FIXED, ORACLE, load_studies
from studies.learned.summary import Summary, elsewhere, hidden, summarize
from studies.pages import path_from, templates, write_text
from studies.style import save
from training.seeds import FLOCKS_PER_RUN, HELD_OUT, TRAINING, TUNING

FIGURES = "figures"
CREDIT = "per-agent-visible"
"""The setting that compares rewards."""


def write_page(results: Path, page: Path) -> str:
    """Write the page, the page of policy files beside it, and the pictures; return the README's table.

    Raises:
        RecordError: if the results are incomplete.
    """
    summaries = summarize(load_studies(results))
    for name, picture in _pictures(summaries).items():
        save(picture, results / FIGURES / name, ("png",))
    for name in listened(results):
        save(draw_listening(results / name / LISTENING_FILE), results / FIGURES / name, ("png",))
    measured = results / INFORMATION_FILE
    if measured.is_file():
        save(draw_information(measured), results / FIGURES / "information", ("png",))
    text = markdown_page(summaries, results / FIGURES, page, listened(results))
    page.parent.mkdir(parents=True, exist_ok=True)
    write_text(page, text)
    board = page.with_name(LEADERBOARD)
    write_text(board, leaderboard_page(summaries, results, board))
    return readme_table(summaries)


def listened(results: Path) -> list[str]:
    """Return the settings with a file of ``measure_listening``."""
    return sorted(file.parent.name for file in results.glob(f"*/{LISTENING_FILE}"))


def markdown_page(
    summaries: Sequence[Summary], pictures: Path, page: Path, watched: Sequence[str] = ()
) -> str:
    """Return the page as Markdown.

    Args:
        summaries: of the settings.
        pictures: folder of the pictures.
        page: file that the page is for.
        watched: settings with a picture of their policy's ranges.
    """
    folder = path_from(page, pictures)
    rendered: str = (
        templates("studies.learned")
        .get_template("results.md")
        .render(
            summaries=summaries,
            credit=[summary for summary in summaries if summary.study.setting == CREDIT],
            hidden=hidden,
            elsewhere=elsewhere,
            pictures=folder,
            watched=watched,
            has_ceilings=(pictures / "ceilings.png").is_file(),
            has_information=(pictures / "information.png").is_file(),
            unaware_range=UNAWARE_RANGE,
            steps_per_action=STEPS_PER_ACTION,
            listening_flocks=LISTENING_FLOCKS,
            missing=[name for name in QUESTIONS if name not in {row.study.setting for row in summaries}],
            best_fixed=BEST_FIXED,
            oracle=ORACLE,
            knowledge=KNOWLEDGE,
            planner_steps=PLANNED_STEPS,
            segments=NUM_SEGMENTS,
            segment_steps=SEGMENT_STEPS,
            confidence=CONFIDENCE,
            resamples=RESAMPLES,
            tuning=TUNING,
            held_out=HELD_OUT,
            training=TRAINING,
            flocks_per_run=FLOCKS_PER_RUN,
        )
    )
    return rendered


def readme_table(summaries: Sequence[Summary]) -> str:
    """Return a short table, one row per setting, as Markdown."""
    rendered: str = (
        templates("studies.learned")
        .get_template("readme_table.md")
        .render(summaries=summaries, best_fixed=BEST_FIXED)
    )
    return rendered.strip()


def _pictures(summaries: Sequence[Summary]) -> dict[str, Figure]:
    """Return the figures by file name; figures without data are left out."""
    studies = [summary.study for summary in summaries]
    shown = figures.shown_studies(studies)
    profiles = {
        study.setting: {
            name: profile(study.values(name), figures.thresholds(study)) for name in figures.profiled(study)
        }
        for study in shown
    }
    bounded = ceilings(summaries)
    drawn = {
        **({"ceilings": bounded} if bounded else {}),
        "gains": figures.gains(summaries),
        "learning_curves": figures.learning_curves(shown),
        "performance_profiles": figures.performance_profiles(shown, profiles),
    }
    explained = [study for study in studies if study.ablation is not None]
    if explained:
        drawn["ablation"] = figures.forests(
            {
                "change of the objective where the entries are hidden (m)": [
                    Group(setting_title(study), hidden(study)) for study in explained
                ]
            }
        )
    moved = [study for study in studies if study.transfer is not None]
    if moved:
        drawn["transfer"] = figures.side_by_side(
            {
                setting_title(study): [
                    Group(f"gain over the {name}", rows) for name, rows in elsewhere(study).items()
                ]
                for study in moved
            },
            "difference (m)",
        )
    return drawn
