"""The page of related results, made from its results file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec

from studies.pages import path_from, signed, templates
from studies.related.attack_speed import CHECK_FLOCKS, NEIGHBORS, SPEEDS, AttackSpeed, scenario
from studies.related.within_episode import (
    ACROSS_EXPLORATION,
    FINAL_FLOCKS,
    FINALISTS,
    FIRST_FLOCKS,
    AcrossEpisodes,
    WithinEpisode,
)

RESULTS_FILE, FIGURE, BANDIT_FILE = "results.json", "attack_speed", "bandit.parquet"


@dataclass(frozen=True)
class RelatedResults:
    """Results from which page and figure are made.

    Attributes:
        command: the command that gives these results.
        attack: the best topological k against the predator's speed.
        within: the bandit within an episode, by objective.
        across: the bandit across episodes.
        versions: of Python and of the packages.
    """

    command: str
    attack: AttackSpeed
    within: dict[str, WithinEpisode]
    across: AcrossEpisodes
    versions: dict[str, str]

    def to_json(self) -> str:
        """Return the results as a JSON document; equal results give equal bytes."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1).decode() + "\n"

    @classmethod
    def from_json(cls, document: str) -> RelatedResults:
        """Build results from their JSON document."""
        return msgspec.json.decode(document, type=cls)


def markdown_page(results: RelatedResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the picture in the folder ``figures``."""
    folder = path_from(page, figures)
    rendered: str = (
        templates("studies.related")
        .get_template("related.md")
        .render(
            results=results,
            attack=results.attack,
            speeds=SPEEDS,
            neighbors=NEIGHBORS,
            check_flocks=CHECK_FLOCKS,
            seconds={speed: scenario(speed).num_steps * scenario(speed).time_step for speed in SPEEDS},
            picture=f"{folder}/{FIGURE}.png",
            bandit_file=f"[{BANDIT_FILE}]({folder}/{BANDIT_FILE})",
            changes={symbol: _changes(values) for symbol, values in results.attack.longer.items()},
            most_pulled=_shares(results.across),
            first_flocks=FIRST_FLOCKS,
            finalists=FINALISTS,
            final_flocks=FINAL_FLOCKS,
            across_exploration=ACROSS_EXPLORATION,
            difference=signed,
        )
    )
    return rendered


def _shares(across: AcrossEpisodes) -> str:
    ranges = sorted(float(rho) for rho in across.most_pulled)
    share = across.most_pulled.get(f"{across.fixed_range:g}", 0.0)
    best = f"{across.fixed_range:g} m in {share:.0%} of the runs"
    return f"between {ranges[0]:g} and {ranges[-1]:g} m; it is {best}"


def _changes(values: tuple[float, ...]) -> str:
    shown = [f"{value:.2f} m at {speed:g}x" for speed, value in zip(SPEEDS, values, strict=True)]
    return ", ".join(text for text, value in zip(shown, values, strict=True) if value) or "0"
