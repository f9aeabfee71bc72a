"""Fixed ranges, built-in rules and policy files on the held-out flocks of a setting."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from training.config import Setting
from training.outputs import CURVE_FLOCKS

from flockesc_env import FlockScenario
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import FloatArray, mean
from flockesc_env.episodes.splits import TUNING, first_seeds, refuse_held_out
from flockesc_env.jobs import Job
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
from flockesc_env.policies import find_policy
from studies.findings.results import BEST_FIXED, EPISODES_FILE, GRID_FILE, ORACLE, RULES_FILE
from studies.measurements import Runner
from studies.playing import play_job
from studies.tables import rows

FLOCK_GRID = (*range(0, 21, 2), 25, 30, 40, 50, 75, 100, 150)
"""Fixed ranges in m among which the best is chosen."""

LINE_GRID = tuple(np.linspace(0, 1, 51).tolist())

VISIBLE_RULES = {
    "mean": ("stubborn-leaders",),
    "minimum": ("stubborn-leaders", "win-stay-lose-shift"),
}
LOCAL_RULES = ("stubborn-leaders-local", "stubborn-witnesses", "listen-while-threatened")
PROFILE_RULES = ("turn-away", "keep-distance")
SETTING_RULES = {
    "shared": ("listen-while-fleeing",),
    "shared-minimum": ("listen-while-fleeing",),
    "per-agent-visible-derived": ("win-stay-lose-shift-escape",),
    "per-agent-visible-profile": ("head-away",),
}
"""Further rules of single settings."""

PolicyFile = tuple[str, int, bytes]
"""Learner, training seed and content of a policy file."""


@dataclasses.dataclass(frozen=True)
class Played:
    """What fixed ranges and policies reach in a setting: as tables of ``Study``."""

    setting: str
    episodes: pl.DataFrame
    grid: pl.DataFrame

    def write(self, folder: Path) -> None:
        """Write both tables to the folder of the setting."""
        write_table(self.episodes, folder / EPISODES_FILE)
        write_table(self.grid, folder / GRID_FILE)


def play_all(
    name: str, setting: Setting, best: float, files: Sequence[PolicyFile], flocks: range, runner: Runner
) -> Played:
    """Play fixed ranges, built-in rules and policy files on the same flocks, without training."""
    fixed = _fixed("Fixed ranges on held-out flocks", setting, flocks, runner)
    policies: dict[tuple[str, int | None], str | bytes] = {
        **{(rule, None): rule for rule in rules_of(name, setting)},
        **{(learner, seed): file for learner, seed, file in files},
    }
    jobs = {key: setting_job(policy, setting, flocks) for key, policy in policies.items()}
    played = runner.each(jobs, "Policies on held-out flocks")
    values = {
        (BEST_FIXED, None): fixed[grid_of(setting).index(best)],
        (ORACLE, None): fixed.max(axis=0),
        **{key: result["objective"] for key, result in played.items()},
    }
    tables = [rows(flocks, row, policy=policy, training_seed=seed) for (policy, seed), row in values.items()]
    grid = [
        {"interaction_range": rho, **dataclasses.asdict(mean(row))}
        for rho, row in zip(grid_of(setting), fixed, strict=True)
    ]
    return Played(name, pl.concat(tables), pl.DataFrame(grid))


def choose_range(setting: Setting, flocks: range, runner: Runner) -> float:
    """Return the fixed range of ``grid_of`` with the largest mean objective on tuning flocks."""
    refuse_held_out(flocks)
    values = _fixed("Fixed ranges on tuning flocks", setting, flocks, runner)
    return grid_of(setting)[int(values.mean(axis=1).argmax())]


def grid_of(setting: Setting) -> tuple[float, ...]:
    """Return the fixed ranges among which the best of a setting is chosen."""
    return LINE_GRID if setting.is_line else tuple(float(rho) for rho in FLOCK_GRID)


def rules_of(name: str, setting: Setting) -> tuple[str, ...]:
    """Return the names of the built-in rules that are reported in a setting."""
    return (*_rules(setting), *SETTING_RULES.get(name, ()))


def write_rules(names: Sequence[str], setting: Setting, runner: Runner, folder: Path) -> None:
    """Play rules on the tuning flocks of learning curves, which choose the best; write their objectives."""
    tuning = first_seeds(TUNING, CURVE_FLOCKS)
    jobs = {name: setting_job(name, setting, tuning) for name in names}
    found = runner.each(jobs, "Rules on tuning flocks")
    if found:
        tables = [rows(tuning, result["objective"], rule=name) for name, result in found.items()]
        write_table(pl.concat(tables), folder / RULES_FILE)


def setting_job(policy: str | bytes, setting: Setting, flocks: range) -> Job:
    """Return the job that plays a policy, a built-in name or the bytes of its file, in a setting."""
    options = rule_options(policy, setting) if isinstance(policy, str) else {}
    return play_job(policy, setting.model, setting.spec.column, flocks, options)


def rule_options(name: str, setting: Setting) -> dict[str, Any]:
    """Return options of a built-in rule in a setting: candidate ranges, if it compares some."""
    is_profiled = "profile_ranges" in find_policy(name).options
    return {"profile_ranges": setting.profile_ranges} if is_profiled else {}


def _fixed(title: str, setting: Setting, flocks: range, runner: Runner) -> FloatArray:
    """Return the objective under every fixed range, shape (ranges, flocks)."""
    jobs = seed_jobs(SWEEP, setting.model, grid_of(setting), flocks)
    return runner.groups({"": jobs}, title)[""][setting.spec.column]


def _rules(setting: Setting) -> tuple[str, ...]:
    if not isinstance(setting.model, FlockScenario) or not setting.per_agent:
        return ()
    if not setting.predator_visible:
        return LOCAL_RULES
    return PROFILE_RULES if setting.profile_ranges else VISIBLE_RULES.get(setting.objective, ())
