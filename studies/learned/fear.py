"""What the escape force is worth to policies: flocks that flee against flocks that do not."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import polars as pl

from flockesc_env import FlockScenario, rollout
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import Estimate, mean
from flockesc_env.jobs import Arrays, Backend, Cache, Job
from flockesc_env.jobs import run as run_jobs
from flockesc_env.policies import find_policy
from studies.learned.held_out import stored_policy
from studies.learned.results import POLICIES, Study, load_studies
from training.seeds import HELD_OUT, first_seeds

FEAR_FILE: Final = "fear.parquet"
FEAR_FLOCKS: Final = 200
RULES: Final = ("head-away", "stubborn-leaders")
"""Rules with the objective J_mean that are measured beside the headline policy of every setting."""

STRENGTHS: Final = (0.0, 10.0)
_SECONDS = 0.03


def measure_fear(results: Path, num_flocks: int, cache: Cache, backend: Backend) -> Path:
    """Play the headline policy of every setting of flocks, and ``RULES``, with and without the escape force.

    The best fixed range of each setting, chosen with the force, plays the same flocks.

    Args:
        results: folder with one folder per setting.
        num_flocks: number of held-out flocks.
        cache: keeps the results of jobs; a job in it is not computed again.
        backend: where jobs run.

    Returns:
        The file of the table: policy (a setting or a rule), strength, seed, objective and fixed, in m.
    """
    flocks = first_seeds(HELD_OUT, num_flocks)
    studies = [study for study in load_studies(results) if not study.is_line]
    played: dict[str, tuple[str | bytes, str, float]] = {
        study.setting: (_headline(study, results), study.spec.column, study.best_fixed_range)
        for study in studies
    }
    fixed = next(study.best_fixed_range for study in studies if study.setting == "per-agent-visible")
    played |= {rule: (rule, "min_mean_distance", fixed) for rule in RULES}
    jobs = {
        (name, strength): Job(
            f"{__name__}:without_fear", (*played[name], strength, flocks), num_flocks * _SECONDS
        )
        for name in played
        for strength in STRENGTHS
    }
    found = run_jobs(list(jobs.values()), cache, backend, title="Fear")
    tables = [
        pl.DataFrame({"policy": name, "strength": strength, "seed": list(flocks), **columns})
        for (name, strength), columns in zip(jobs, found, strict=True)
    ]
    write_table(pl.concat(tables), results / FEAR_FILE)
    return results / FEAR_FILE


def _headline(study: Study, results: Path) -> bytes:
    name = f"{study.best_learner}-{study.best_seed}.npz"
    return (results / study.setting / POLICIES / name).read_bytes()


def without_fear(
    policy: str | bytes, column: str, fixed_range: float, strength: float, flocks: range
) -> Arrays:
    """Return the objective of a policy and of a fixed range under an escape force, shape (flocks,).

    Args:
        policy: name of a built-in policy, or the bytes of a policy file.
        column: of the objective.
        fixed_range: in m.
        strength: escape force s; 0: agents do not flee.
        flocks: seeds.
    """
    entry = find_policy(policy) if isinstance(policy, str) else stored_policy(policy)
    scenario = entry.scenario or FlockScenario()
    assert isinstance(scenario, FlockScenario)  # noqa: S101, settings of lines have no escape force to compare
    forced = scenario.replace(repulsion_strength=strength)
    return {
        "objective": getattr(rollout(forced, entry, flocks), column),
        "fixed": getattr(rollout(forced, f"fixed:{fixed_range:.12g}", flocks), column),
    }


def fear_figures(file: Path) -> dict[str, dict[str, Estimate]]:
    """Return estimates in m for every setting and rule in the table.

    ``fleeing`` and ``fearless`` are the policy's objective with and without the force, ``force`` their paired
    difference. ``gain_fleeing`` and ``gain_fearless`` are the paired gains over the best fixed range.
    """
    table = pl.read_parquet(file)
    found = {}
    for name in table["policy"].unique(maintain_order=True):
        fearless, fleeing = (
            table.filter(policy=name, strength=strength).sort("seed") for strength in STRENGTHS
        )
        policy, fixed = (
            [rows[column].to_numpy() for rows in (fearless, fleeing)] for column in ("objective", "fixed")
        )
        found[name] = {
            "fearless": mean(policy[0]),
            "fleeing": mean(policy[1]),
            "force": mean(policy[1] - policy[0]),
            "gain_fearless": mean(policy[0] - fixed[0]),
            "gain_fleeing": mean(policy[1] - fixed[1]),
        }
    return found
