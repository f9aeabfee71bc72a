"""The page of policy files: a card for every file, and the best file of every setting."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flockesc_env.common.stats import CONFIDENCE, Estimate
from studies.learned.aggregate import means
from studies.learned.results import BEST_FIXED, POLICIES
from studies.learned.summary import Summary
from studies.pages import path_from, templates
from training.seeds import HELD_OUT

PAGE = "leaderboard.md"


@dataclass(frozen=True)
class Card:
    """A policy file.

    Attributes:
        path: of the file.
        learner: name of the learner.
        training_seed: of the run.
        objective: mean over the held-out flocks.
        gain: paired difference to the best fixed range on the same flocks.
        sha256: of the file.
    """

    path: Path
    learner: str
    training_seed: int
    objective: Estimate
    gain: Estimate
    sha256: str


def cards(summary: Summary, results: Path) -> list[Card]:
    """Return the cards of a setting; a run without a file has none."""
    study = summary.study
    files = [
        (results / study.setting / POLICIES / f"{learner}-{seed}.npz", learner, seed, values)
        for learner in study.trained
        for seed, values in zip(study.training_seeds(learner), study.values(learner), strict=True)
    ]
    files = [file for file in files if file[0].is_file()]
    if not files:
        return []
    reached = np.stack([values for *_, values in files])
    gains = reached - study.values(BEST_FIXED)[0]
    estimates = means(np.concatenate([reached, gains])[:, np.newaxis])
    return [
        Card(path, learner, seed, objective, gain, hashlib.sha256(path.read_bytes()).hexdigest())
        for (path, learner, seed, _), objective, gain in zip(
            files, estimates[: len(files)], estimates[len(files) :], strict=True
        )
    ]


def leaderboard_page(summaries: Sequence[Summary], results: Path, page: Path) -> str:
    """Return the page as Markdown.

    Args:
        summaries: of the settings.
        results: folder of the settings' folders.
        page: file that the page is for.
    """
    rows = [(summary, files) for summary in summaries if (files := cards(summary, results))]
    rendered: str = (
        templates("studies.learned")
        .get_template(PAGE)
        .render(
            rows=rows,
            best={summary.study.setting: _best(summary, files) for summary, files in rows},
            sizes=[round(card.path.stat().st_size / 1000) for _, files in rows for card in files],
            versions={", ".join(f"{n} {v}" for n, v in s.study.versions.items()): None for s, _ in rows},
            link=lambda path: path_from(page, path),
            confidence=CONFIDENCE,
            held_out=HELD_OUT,
        )
    )
    return rendered.rstrip() + "\n"


def _best(summary: Summary, files: Sequence[Card]) -> Card:
    """Return the file that was best on tuning flocks, so that held-out flocks choose nothing."""
    tuned = summary.study.tuned
    return max(files, key=lambda card: tuned[card.learner, card.training_seed])
