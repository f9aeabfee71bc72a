"""The control: what policies gain in flocks that hear warnings and in flocks in which these are blocked."""

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

FILE: Final = "blocking.parquet"
FLOCKS: Final = 200
RULES: Final = ("head-away", "stubborn-leaders")
"""Rules that play ``per-agent-visible`` beside the headline policies."""

CONTROLS: Final = (False, True)
"""Whether warnings are blocked."""


def measure(headlines: Sequence[Headline], scale: float, runner: Runner, output: Path) -> None:
    """Play the headline policies, ``RULES`` and the best fixed ranges, with and without warnings.

    The table has the columns policy (a task or a rule), blocked, seed, and objective and fixed in m. The best
    fixed range of each task was chosen with warnings.
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
        for blocked in CONTROLS:
            scenario = headline.task.scenario.replace(blocks_warnings=blocked)
            fixed = f"fixed:{headline.best_fixed_range:.12g}"
            jobs[name, blocked, "objective"] = play_job(policy, scenario, headline.task.spec.name, flocks)
            jobs[name, blocked, "fixed"] = play_job(fixed, scenario, headline.task.spec.name, flocks)
    found = {key: values["objective"] for key, values in runner.each(jobs, "Warnings").items()}
    tables = [
        rows(flocks, found[name, blocked, "objective"], policy=name, blocked=blocked).with_columns(
            fixed=found[name, blocked, "fixed"]
        )
        for name in played
        for blocked in CONTROLS
    ]
    write_table(pl.concat(tables), output / FILE)


def estimates(output: Path) -> dict[str, dict[str, Estimate]]:
    """Return estimates in m for every task and rule in the table.

    ``hearing`` and ``blocked`` are the policy's objective with and without warnings, ``warning`` their paired
    difference. ``gain_hearing`` and ``gain_blocked`` are the paired gains over the best fixed range.
    """
    table = pl.read_parquet(output / FILE)
    policy, fixed = (
        values_by(table, "policy", "blocked", column=column) for column in ("objective", "fixed")
    )
    return {
        name: {
            "hearing": mean(policy[name, False]),
            "blocked": mean(policy[name, True]),
            "warning": mean(policy[name, False] - policy[name, True]),
            "gain_hearing": mean(policy[name, False] - fixed[name, False]),
            "gain_blocked": mean(policy[name, True] - fixed[name, True]),
        }
        for name in table["policy"].unique(maintain_order=True)
    }
