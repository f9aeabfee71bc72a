"""The page of policy files: a card for every file, and the best file of every setting."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flockesc_env.common.stats import CONFIDENCE, Estimate
from studies.learned.aggregate import means
from studies.learned.results import BEST_FIXED
from studies.learned.summary import Summary
from studies.pages import path_from, render
from training.seeds import HELD_OUT

PAGE = "leaderboard.md"


@dataclass(frozen=True)
class Card:
    """A policy file: its run, mean objective on held-out flocks, and gain over the best fixed range."""

    path: Path
    learner: str
    training_seed: int
    objective: Estimate
    gain: Estimate
    sha256: str


def cards(summary: Summary) -> list[Card]:
    """Return the cards of a setting; a run without a file has none."""
    study = summary.study
    files = {
        (study.file(learner, seed), learner, seed): values
        for learner in study.trained
        for seed, values in zip(study.training_seeds(learner), study.values(learner), strict=True)
        if study.file(learner, seed).is_file()
    }
    if not files:
        return []
    reached = np.stack(list(files.values()))
    estimates = iter(
        means(
            np.stack([reached, reached - study.values(BEST_FIXED)], axis=1).reshape(-1, 1, reached.shape[1])
        )
    )
    return [
        Card(*file, next(estimates), next(estimates), hashlib.sha256(file[0].read_bytes()).hexdigest())
        for file in files
    ]


def leaderboard_page(summaries: Sequence[Summary], page: Path) -> str:
    """Return the page as Markdown, for the file ``page``."""
    rows = [(summary, files) for summary in summaries if (files := cards(summary))]
    text = render(
        "learned/leaderboard.md",
        rows=rows,
        best={summary.study.setting: _best(summary, files) for summary, files in rows},
        sizes=[round(card.path.stat().st_size / 1000) for _, files in rows for card in files],
        versions={", ".join(f"{n} {v}" for n, v in s.study.versions.items()): None for s, _ in rows},
        link=lambda path: path_from(page, path),
        confidence=CONFIDENCE,
        held_out=HELD_OUT,
    )
    return text.rstrip() + "\n"


def _best(summary: Summary, files: Sequence[Card]) -> Card:
    """Return the file that was best on tuning flocks, so that held-out flocks choose nothing."""
    tuned = summary.study.tuned
    return max(files, key=lambda card: tuned[card.learner, card.training_seed])
