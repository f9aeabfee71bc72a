"""The page of related results, made from its results file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from studies.pages import compared, path_from, render, signed
from studies.related.within_episode import (
    ACROSS_EXPLORATION,
    FINAL_FLOCKS,
    FINALISTS,
    FIRST_FLOCKS,
    AcrossEpisodes,
    WithinEpisode,
)
from studies.study import Results

BANDIT_FILE = "bandit.parquet"


@dataclass(frozen=True)
class RelatedResults(Results):
    """Bandits within an episode and across episodes."""

    command: str
    within: dict[str, WithinEpisode]
    across: AcrossEpisodes
    versions: dict[str, str]


def markdown_page(results: RelatedResults, output: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the results in the folder ``output``."""
    return render(
        "related/related.md",
        results=results,
        bandit_file=f"[{BANDIT_FILE}]({path_from(page, output)}/{BANDIT_FILE})",
        most_pulled=_shares(results.across),
        first_flocks=FIRST_FLOCKS,
        finalists=FINALISTS,
        final_flocks=FINAL_FLOCKS,
        across_exploration=ACROSS_EXPLORATION,
        difference=signed,
        compared=compared,
    )


def _shares(across: AcrossEpisodes) -> str:
    ranges = sorted(float(rho) for rho in across.most_pulled)
    share = across.most_pulled.get(f"{across.fixed_range:g}", 0.0)
    best = f"{across.fixed_range:g} m in {share:.0%} of the runs"
    return f"between {ranges[0]:g} and {ranges[-1]:g} m; it is {best}"
