"""The control: what policies gain in flocks that flee and in flocks that do not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import polars as pl

from flockesc_env import FlockScenario
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import Estimate, mean
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.tasks import tasks
from studies.findings.headlines import Headline, share_of
from studies.measurements import Runner
from studies.playing import play_job
from studies.tables import rows, values_by

FILE: Final = "fear.parquet"
FLOCKS: Final = 200
RULES: Final = ("head-away", "stubborn-leaders")
"""Rules that play ``per-agent-visible`` beside the headline policies."""

STRENGTHS: Final = (0.0, 10.0)
"""Strength of the escape force in flocks that do not flee, and in those that do."""


def measure(headlines: Sequence[Headline], scale: float, runner: Runner, output: Path) -> None:
    """Play the headline policies and ``RULES`` with and without the escape force, and the best fixed ranges.

    The table has the columns policy (a task or a rule), strength, seed, and objective and fixed in m. The
    best fixed range of each task was chosen with the force.
    """
    flocks = share_of(HELD_OUT, FLOCKS, scale)
    visible = Headline(tasks["per-agent-visible"], Path())
    played: dict[str, tuple[str | bytes, Headline]] = {
        **{headline.task.name: (headline.content, headline) for headline in headlines},
        **{rule: (rule, visible) for rule in RULES},
    }
    jobs = {}
    for name, (policy, headline) in played.items():
        assert isinstance(headline.task.scenario, FlockScenario)  # noqa: S101, ``EXPLAINED`` has no line
        for strength in STRENGTHS:
            scenario = headline.task.scenario.replace(repulsion_strength=strength)
            fixed = f"fixed:{headline.best_fixed_range:.12g}"
            jobs[name, strength, "objective"] = play_job(policy, scenario, headline.task.spec.name, flocks)
            jobs[name, strength, "fixed"] = play_job(fixed, scenario, headline.task.spec.name, flocks)
    found = {key: values["objective"] for key, values in runner.each(jobs, "Escape force").items()}
    tables = [
        rows(flocks, found[name, strength, "objective"], policy=name, strength=strength).with_columns(
            fixed=found[name, strength, "fixed"]
        )
        for name in played
        for strength in STRENGTHS
    ]
    write_table(pl.concat(tables), output / FILE)


def estimates(output: Path) -> dict[str, dict[str, Estimate]]:
    """Return estimates in m for every task and rule in the table.

    ``fearless`` and ``fleeing`` are the policy's objective without and with the force, ``force`` their paired
    difference. ``gain_fearless`` and ``gain_fleeing`` are the paired gains over the best fixed range.
    """
    table = pl.read_parquet(output / FILE)
    policy, fixed = (
        values_by(table, "policy", "strength", column=column) for column in ("objective", "fixed")
    )
    calm, afraid = STRENGTHS
    return {
        name: {
            "fearless": mean(policy[name, calm]),
            "fleeing": mean(policy[name, afraid]),
            "force": mean(policy[name, afraid] - policy[name, calm]),
            "gain_fearless": mean(policy[name, calm] - fixed[name, calm]),
            "gain_fleeing": mean(policy[name, afraid] - fixed[name, afraid]),
        }
        for name in table["policy"].unique(maintain_order=True)
    }
