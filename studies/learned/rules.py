"""The rules of a setting on tuning flocks, which choose the best untrained rule."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from flockesc_env.common.array_files import write_table
from flockesc_env.jobs import Backend, Cache, run
from studies.learned.held_out import play_job
from studies.learned.results import RULES_FILE
from training.config import Setting
from training.outputs import CURVE_FLOCKS
from training.seeds import TUNING, first_seeds


def write_rules(names: Sequence[str], setting: Setting, cache: Cache, backend: Backend, folder: Path) -> None:
    """Play rules on the tuning flocks of learning curves and write their objectives; none: write nothing.

    Raises:
        JobError: if jobs fail.
    """
    if not names:
        return
    tuning = first_seeds(TUNING, CURVE_FLOCKS)
    jobs = [play_job(name, setting, tuning) for name in names]
    results = run(jobs, cache, backend, title="Rules on tuning flocks")
    tables = [
        pl.DataFrame({"rule": name, "seed": tuning, "objective": result["objective"]})
        for name, result in zip(names, results, strict=True)
    ]
    write_table(pl.concat(tables), folder / RULES_FILE)
