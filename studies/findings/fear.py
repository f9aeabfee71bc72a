"""What the escape force is worth to policies: flocks that flee against flocks that do not."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import polars as pl

from flockesc_env import FlockScenario
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import Estimate, mean
from flockesc_env.episodes.splits import HELD_OUT, first_seeds
from studies.findings.results import load_studies
from studies.measurements import Runner
from studies.playing import play_job, policy_of
from studies.tables import rows, values_by

FEAR_FILE: Final = "fear.parquet"
FEAR_FLOCKS: Final = 200
RULES: Final = ("head-away", "stubborn-leaders")
"""Rules with the objective J_mean that are measured beside the headline policy of every setting."""

STRENGTHS: Final = (0.0, 10.0)


def measure_fear(results: Path, num_flocks: int, runner: Runner) -> Path:
    """Play the headline policy of every setting of flocks, and ``RULES``, with and without the escape force.

    The best fixed range of each setting, chosen with the force, plays the same flocks. Return the file of the
    table: policy (a setting or a rule), strength, seed, objective and fixed, in m.
    """
    flocks = first_seeds(HELD_OUT, num_flocks)
    studies = {study.setting: study for study in load_studies(results) if not study.is_line}
    fixed = studies["per-agent-visible"].best_fixed_range
    played: dict[str, tuple[str | bytes, str, float]] = {
        **{name: (s.file().read_bytes(), s.spec.column, s.best_fixed_range) for name, s in studies.items()},
        **{rule: (rule, "min_mean_distance", fixed) for rule in RULES},
    }
    jobs = {}
    for name, (policy, column, rho) in played.items():
        scenario = policy_of(policy).scenario or FlockScenario()
        for strength in STRENGTHS:
            forced = scenario.replace(repulsion_strength=strength)
            jobs[name, strength, "objective"] = play_job(policy, forced, column, flocks)
            jobs[name, strength, "fixed"] = play_job(f"fixed:{rho:.12g}", forced, column, flocks)
    found = runner.each(jobs, "Fear")
    tables = [
        rows(
            flocks, found[name, strength, "objective"]["objective"], policy=name, strength=strength
        ).with_columns(fixed=found[name, strength, "fixed"]["objective"])
        for name in played
        for strength in STRENGTHS
    ]
    write_table(pl.concat(tables), results / FEAR_FILE)
    return results / FEAR_FILE


def fear_figures(file: Path) -> dict[str, dict[str, Estimate]]:
    """Return estimates in m for every setting and rule in the table.

    ``fleeing`` and ``fearless`` are the policy's objective with and without the force, ``force`` their paired
    difference. ``gain_fleeing`` and ``gain_fearless`` are the paired gains over the best fixed range.
    """
    table = pl.read_parquet(file)
    policy, fixed = (
        values_by(table, "policy", "strength", column=column) for column in ("objective", "fixed")
    )
    return {
        name: {
            "fearless": mean(policy[name, 0.0]),
            "fleeing": mean(policy[name, 10.0]),
            "force": mean(policy[name, 10.0] - policy[name, 0.0]),
            "gain_fearless": mean(policy[name, 0.0] - fixed[name, 0.0]),
            "gain_fleeing": mean(policy[name, 10.0] - fixed[name, 10.0]),
        }
        for name in table["policy"].unique(maintain_order=True)
    }
