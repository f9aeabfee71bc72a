"""Synthetic results of studies in the files that a study writes, and checks of committed pages."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest

from flockesc_env.common import stats
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from studies.findings.page import DETAILS, details_page, markdown_page, readme_table
from studies.findings.results import load_studies
from studies.findings.summary import Summary, summarize

LEARNER = {"kind": "search", "arguments": {}, "note": ""}


def write_study(
    results: Path,
    setting: str,
    baselines: Mapping[str, np.ndarray],
    learners: Mapping[str, np.ndarray],
    *,
    about: Mapping[str, Mapping[str, Any]] | None = None,
    ablation: Iterable[tuple[str, np.ndarray]] = (),
    transfer: Iterable[tuple[str, str, np.ndarray]] = (),
    rules: Mapping[str, np.ndarray] | None = None,
    **fields: Any,
) -> Path:
    """Write one folder; baselines have shape (flocks,), learners (training seeds, flocks).

    ``rules`` holds the objectives of built-in rules on tuning flocks.
    """
    folder = results / setting
    folder.mkdir(parents=True)
    flocks = HELD_OUT[: len(baselines["best fixed range"])]
    document = {
        "setting": setting,
        "title": f"about {setting}",
        "command": f"python -m studies findings {setting}",
        "objective": "mean",
        "is_line": False,
        "tuning_flocks": 40,
        "held_out_flocks": len(flocks),
        "best_fixed_range": 8.5,
        "learners": {name: {**LEARNER, **(about or {}).get(name, {})} for name in learners},
        "versions": {"numpy": "2.0"},
        "machine": "1 core",
        **fields,
    }
    (folder / "study.json").write_text(json.dumps(document))
    rows = [(name, None, values) for name, values in baselines.items()]
    rows += [(name, seed, values) for name, runs in learners.items() for seed, values in enumerate(runs)]
    episodes = [_episodes(flocks, values, policy=name, training_seed=seed) for name, seed, values in rows]
    pl.concat(episodes).select("policy", "training_seed", "seed", "objective").write_parquet(
        folder / "episodes.parquet"
    )
    runs = [(name, seed) for name, values in learners.items() for seed in range(len(values))]
    _runs(runs).write_parquet(folder / "runs.parquet")
    _curves(learners).write_parquet(folder / "curves.parquet")
    grid = {"interaction_range": [0.0, 8.5], "mean": [1.0, 2.0], "low": [0.5, 1.5], "high": [1.5, 2.5]}
    pl.DataFrame(grid).write_parquet(folder / "grid.parquet")
    parts = [_episodes(flocks, values, removed=name) for name, values in ablation]
    if parts:
        pl.concat(parts).write_parquet(folder / "ablation.parquet")
    worlds = [_episodes(flocks, values, world=world, policy=name) for world, name, values in transfer]
    if worlds:
        pl.concat(worlds).write_parquet(folder / "transfer.parquet")
    tuned = [_episodes(TUNING[: len(values)], values, rule=name) for name, values in (rules or {}).items()]
    if tuned:
        pl.concat(tuned).write_parquet(folder / "rules.parquet")
    return folder


def _episodes(flocks: range, values: np.ndarray, **labels: Any) -> pl.DataFrame:
    table = pl.DataFrame(
        {"seed": flocks, "objective": values}, schema={"seed": pl.Int64, "objective": pl.Float64}
    )
    seed = {"training_seed": pl.lit(labels["training_seed"], pl.Int64)} if "training_seed" in labels else {}
    return table.with_columns(**{name: pl.lit(label) for name, label in labels.items()} | seed)


def _runs(runs: list[tuple[str, int]]) -> pl.DataFrame:
    names, seeds = zip(*runs, strict=True)
    return pl.DataFrame(
        {
            "learner": names,
            "training_seed": seeds,
            "minutes": [2.0 + seed for seed in seeds],
            "episodes": [1000] * len(runs),
            "samples_per_second": [50_000.0 if name == "ppo" else None for name in names],
            "environment_share": [0.25 if name == "ppo" else None for name in names],
        },
        schema_overrides={"samples_per_second": pl.Float64, "environment_share": pl.Float64},
    )


def _curves(learners: Mapping[str, np.ndarray]) -> pl.DataFrame:
    """Return learning curves that rise to the learner's value on the held-out flocks."""
    rows = [
        (name, seed, episodes, episodes / 10, values.mean() * (1 - 0.5 * 64 / episodes))
        for name, runs in learners.items()
        for seed, values in enumerate(runs)
        for episodes in (64, 128, 256, 512, 1024, 2048, 4096)
    ]
    columns = ["learner", "training_seed", "episodes", "seconds", "objective"]
    return pl.DataFrame(rows, schema=columns, orient="row")


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
    """Compare docs/findings.md, its details and the table of the README; return what they show."""
    folder, page = RESULTS / "findings", ROOT / "docs" / "findings.md"
    summaries = summarize(load_studies(folder))
    assert shown(page.read_text("utf-8")) == shown(markdown_page(summaries, folder, page))
    details = page.with_name(DETAILS)
    assert shown(details.read_text("utf-8")) == shown(details_page(summaries, folder, details))
    assert shown(readme_table(summaries)) in shown((ROOT / "README.md").read_text("utf-8"))
    return summaries
