"""The page of related results, made from its results file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from flockesc_env.common.stats import Estimate
from studies.pages import compared, path_from, render, signed
from studies.related.attack_speed import CHECK_FLOCKS, NEIGHBORS, SPEEDS, AttackSpeed, scenario, step_length
from studies.related.within_episode import (
    ACROSS_EXPLORATION,
    FINAL_FLOCKS,
    FINALISTS,
    FIRST_FLOCKS,
    AcrossEpisodes,
    WithinEpisode,
)
from studies.study import Results

FEW = 30
"""Largest k of the sentence about few neighbors."""

FIGURE, BANDIT_FILE = "attack_speed", "bandit.parquet"


@dataclass(frozen=True)
class RelatedResults(Results):
    """The best topological k by the predator's speed, and bandits within an episode and across episodes."""

    command: str
    attack: AttackSpeed
    within: dict[str, WithinEpisode]
    across: AcrossEpisodes
    versions: dict[str, str]


def markdown_page(results: RelatedResults, figures: Path, page: Path) -> str:
    """Return the page as Markdown, for the file ``page``, with the picture in the folder ``figures``."""
    folder, attack = path_from(page, figures), results.attack
    return render(
        "related/related.md",
        results=results,
        attack=attack,
        speeds=SPEEDS,
        neighbors=NEIGHBORS,
        check_flocks=CHECK_FLOCKS,
        seconds={speed: scenario(speed).num_steps * scenario(speed).time_step for speed in SPEEDS},
        picture=f"{folder}/{FIGURE}.png",
        bandit_file=f"[{BANDIT_FILE}]({folder}/{BANDIT_FILE})",
        changes={symbol: _changes(values) for symbol, values in attack.longer.items()},
        most_pulled=_shares(results.across),
        first_flocks=FIRST_FLOCKS,
        finalists=FINALISTS,
        final_flocks=FINAL_FLOCKS,
        across_exploration=ACROSS_EXPLORATION,
        difference=signed,
        compared=compared,
        signs={symbol: _signs([row.curve[-1] for row in best]) for symbol, best in attack.best.items()},
        few=FEW,
        few_change={symbol: _few_change(attack, symbol) for symbol in attack.best},
        refuted={symbol: _at(row.is_refuted for row in best) for symbol, best in attack.best.items()},
        unresolved=[
            (speed, row.largest, step_length(speed))
            for speed, row in zip(SPEEDS, attack.best["J_min"], strict=True)
            if row.largest < step_length(speed)
        ],
    )


def _shares(across: AcrossEpisodes) -> str:
    ranges = sorted(float(rho) for rho in across.most_pulled)
    share = across.most_pulled.get(f"{across.fixed_range:g}", 0.0)
    best = f"{across.fixed_range:g} m in {share:.0%} of the runs"
    return f"between {ranges[0]:g} and {ranges[-1]:g} m; it is {best}"


def _changes(values: tuple[float, ...]) -> str:
    shown = [f"{value:.2f} m at {speed:g}x" for speed, value in zip(SPEEDS, values, strict=True)]
    return ", ".join(text for text, value in zip(shown, values, strict=True) if value) or "0"


def _few_change(attack: AttackSpeed, symbol: str) -> float:
    """Return the largest change in m of a mean objective from k = 1 to any k <= ``FEW``, at any speed."""
    few = NEIGHBORS.index(FEW) + 1
    return max(abs(change.mean) for row in attack.best[symbol] for change in row.curve[:few])


def _signs(differences: Sequence[Estimate]) -> dict[str, str]:
    """Return the speeds at which a difference is larger than 0, smaller, and neither."""
    words = [compared(difference) for difference in differences]
    return {word: _at(one == word for one in words) for word in dict.fromkeys(words)}


def _at(is_so: Iterable[bool]) -> str:
    """Return the speeds at which something is so, as text; empty: at none."""
    names = [f"{speed:g}x" for speed, so in zip(SPEEDS, is_so, strict=True) if so]
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
