"""Committed pages against the pages that their committed results give."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flockesc_env.common import stats
from studies.arms_race.page import markdown_page as race_page
from studies.arms_race.results import load_race
from studies.learned.page import DETAILS, details_page, markdown_page, readme_table
from studies.learned.results import load_studies
from studies.learned.summary import Summary, summarize

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "results"
INTERVAL = re.compile(r"\[[-+]?[\d,.]+, [-+]?[\d,.]+\]|± [\d.]+")

Shown = Callable[[str], str]


def without_intervals(text: str) -> str:
    return INTERVAL.sub("[]", text)


def skip_bootstraps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give every interval the width 0. Bootstraps take most of the time of a page."""

    def bootstrap(sample: Any, statistic: Any, **_: Any) -> Any:
        value = statistic(*(np.asarray(values)[None] for values in sample), axis=-1)[..., 0]
        return SimpleNamespace(confidence_interval=SimpleNamespace(low=value, high=value))

    monkeypatch.setattr(stats, "bootstrap", bootstrap)


def check_results(shown: Shown = str) -> list[Summary]:
    """Compare docs/results.md, its details and the table of the README; return what they show."""
    folder, page = RESULTS / "learned", ROOT / "docs" / "results.md"
    summaries = summarize(load_studies(folder))
    assert shown(page.read_text()) == shown(markdown_page(summaries, folder, page))
    details = page.with_name(DETAILS)
    assert shown(details.read_text()) == shown(details_page(summaries, folder, details))
    assert shown(readme_table(summaries)) in shown((ROOT / "README.md").read_text())
    return summaries


def check_race(shown: Shown = str) -> None:
    folder, page = RESULTS / "arms_race", ROOT / "docs" / "arms-race.md"
    assert shown(page.read_text()) == shown(race_page(load_race(folder), folder, page))
