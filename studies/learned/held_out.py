"""Fixed ranges, built-in rules and policy files on the held-out flocks of a setting."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import polars as pl

from flockesc_env import FlockScenario, LineScenario, NamedPolicy, load_policy, rollout
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import FloatArray, mean
from flockesc_env.jobs import Arrays, Backend, Cache, Job, run
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import joined, seed_jobs
from flockesc_env.policies import find_policy
from studies.learned.results import BEST_FIXED, EPISODES_FILE, GRID_FILE, ORACLE
from training.config import Setting
from training.presets import presets

FLOCK_GRID = (*range(0, 21, 2), 25, 30, 40, 50, 75, 100, 150)
"""Fixed ranges in m among which the best is chosen."""

LINE_GRID = tuple(np.linspace(0, 1, 51).tolist())

VISIBLE_RULES = {
    "mean": ("stubborn-leaders",),
    "minimum": ("stubborn-leaders", "win-stay-lose-shift"),
}
LOCAL_RULES = ("stubborn-leaders-local", "stubborn-witnesses", "listen-while-threatened")
LOCAL_PROFILE_RULES = ("stubborn-witnesses", "spread-out")
PROFILE_RULES = ("turn-away", "keep-distance")
SHARED_PROFILE_RULES = ("turn-flock-away", "turn-flock-from-predator")
SETTING_RULES = {
    "shared": ("listen-while-fleeing",),
    "shared-minimum": ("listen-while-fleeing",),
    "per-agent-visible-derived": ("win-stay-lose-shift-escape",),
    "per-agent-visible-profile": ("head-away",),
    "per-agent-visible-profile-minimum": ("step-aside",),
    "shared-profile": ("wait-for-escape",),
    "steering-predator-profile": ("head-away",),
}
"""Further rules of single settings."""

PolicyFile = tuple[str, int, bytes]
"""Learner, training seed and content of a policy file."""

_AGENT_STEP = 80e-9
"""Estimated seconds of a step of one agent under a network."""


@dataclasses.dataclass(frozen=True)
class Played:
    """What fixed ranges and policies reach in a setting.

    Attributes:
        setting: name of the setting.
        episodes: policy, training_seed (null where nothing was trained), seed, objective.
        grid: interaction_range, mean, low, high, of fixed ranges.
    """

    setting: str
    episodes: pl.DataFrame
    grid: pl.DataFrame

    def write(self, folder: Path) -> None:
        """Write both tables to the folder of the setting; policies that others submitted are kept."""
        submitted = _submitted(self.episodes, self.setting, folder)
        write_table(pl.concat([self.episodes, submitted]), folder / EPISODES_FILE)
        write_table(self.grid, folder / GRID_FILE)


def play_all(
    name: str,
    setting: Setting,
    best: float,
    files: Sequence[PolicyFile],
    flocks: range,
    cache: Cache,
    backend: Backend,
) -> Played:
    """Play fixed ranges, built-in rules and policy files on the same flocks, without training.

    Args:
        name: name of the setting.
        setting: the task.
        best: the best fixed range, one of ``grid_of``.
        files: the policy files.
        flocks: seeds of the flocks.
        cache: keeps the results of jobs; a job in it is not computed again.
        backend: where jobs run.

    Raises:
        JobError: if jobs fail.
    """
    fixed = _fixed("Fixed ranges on held-out flocks", setting, flocks, cache, backend)
    rows = [
        _rows(BEST_FIXED, None, flocks, fixed[grid_of(setting).index(best)]),
        _rows(ORACLE, None, flocks, fixed.max(axis=0)),
    ]
    policies: list[tuple[str, int | None, str | bytes]]
    policies = [(rule, None, rule) for rule in rules_of(name, setting)]
    policies += files
    jobs = [play_job(policy, setting, flocks) for _, _, policy in policies]
    results = run(jobs, cache, backend, title="Policies on held-out flocks")
    for (policy, seed, _), result in zip(policies, results, strict=True):
        rows.append(_rows(policy, seed, flocks, result["objective"]))
    return Played(name, pl.concat(rows), _grid_frame(setting, fixed))


def choose_range(setting: Setting, flocks: range, cache: Cache, backend: Backend) -> float:
    """Return the fixed range of ``grid_of`` with the largest mean objective on tuning flocks."""
    values = _fixed("Fixed ranges on tuning flocks", setting, flocks, cache, backend)
    return grid_of(setting)[int(values.mean(axis=1).argmax())]


def grid_of(setting: Setting) -> tuple[float, ...]:
    """Return the fixed ranges among which the best of a setting is chosen."""
    return LINE_GRID if setting.is_line else tuple(float(rho) for rho in FLOCK_GRID)


def rules_of(name: str, setting: Setting) -> tuple[str, ...]:
    """Return the names of the built-in rules that are reported in a setting."""
    return (*_rules(setting), *SETTING_RULES.get(name, ()))


def play_job(policy: str | bytes, setting: Setting, flocks: range) -> Job:
    """Return the job that plays a policy, a built-in name or the bytes of its file, on some flocks."""
    model = setting.model
    steps = 100 if isinstance(model, LineScenario) else model.num_steps
    seconds = len(flocks) * steps * model.num_agents * _AGENT_STEP
    return Job("studies.learned.held_out:objectives", (policy, setting, flocks), seconds)


def objectives(policy: str | bytes, setting: Setting, flocks: range) -> Arrays:
    """Return the objective of every flock, with the options that the policy was made for."""
    entry = rule_of(policy, setting) if isinstance(policy, str) else stored_policy(policy)
    return {"objective": setting.spec.values(rollout(setting.model, entry, flocks))}


def rule_of(name: str, setting: Setting) -> NamedPolicy:
    """Return a built-in rule; one that compares candidate ranges gets those of the setting."""
    entry = find_policy(name)
    if "profile_ranges" not in entry.options:
        return entry
    return dataclasses.replace(entry, options={**entry.options, "profile_ranges": setting.profile_ranges})


def stored_policy(file: bytes) -> NamedPolicy:
    """Return the policy in the bytes of a policy file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "policy.npz"
        path.write_bytes(file)
        return load_policy(path)


def _fixed(title: str, setting: Setting, flocks: range, cache: Cache, backend: Backend) -> FloatArray:
    """Return the objective under every fixed range, shape (ranges, flocks)."""
    jobs = seed_jobs(SWEEP, setting.model, grid_of(setting), flocks)
    return joined(run(jobs, cache, backend, title=title))[setting.spec.column]


def _rules(setting: Setting) -> tuple[str, ...]:
    if not isinstance(setting.model, FlockScenario):
        return ()
    informed = bool(setting.profile_ranges)
    if not setting.per_agent:
        return SHARED_PROFILE_RULES if informed else ()
    if setting.predator_visible:
        return PROFILE_RULES if informed else VISIBLE_RULES.get(setting.objective, ())
    return LOCAL_PROFILE_RULES if informed else LOCAL_RULES


def _rows(name: str, seed: int | None, flocks: range, values: FloatArray) -> pl.DataFrame:
    """Return the rows of a policy in the table of episodes; ``seed`` is its training seed, if it has one."""
    schema = {"policy": pl.String, "training_seed": pl.Int64, "seed": pl.Int64, "objective": pl.Float64}
    columns = {"policy": [name] * len(flocks), "training_seed": [seed] * len(flocks)}
    return pl.DataFrame({**columns, "seed": flocks, "objective": values}, schema=schema)


def _submitted(made: pl.DataFrame, setting: str, folder: Path) -> pl.DataFrame:
    """Return the rows of an earlier file that others have submitted, if they are about the same flocks."""
    if not (folder / EPISODES_FILE).is_file():
        return made.clear()
    own = {*made["policy"], *presets()[setting].learners}
    # Policies trained here have a training seed, under any name.
    others = pl.read_parquet(folder / EPISODES_FILE).filter(
        ~pl.col("policy").is_in(own), pl.col("training_seed").is_null()
    )
    flocks = made["seed"].unique().sort()
    parts = others.select(made.columns).partition_by("policy")
    return pl.concat([made.clear(), *(part for part in parts if part["seed"].sort().equals(flocks))])


def _grid_frame(setting: Setting, values: FloatArray) -> pl.DataFrame:
    estimates = [mean(row) for row in values]
    return pl.DataFrame(
        {
            "interaction_range": grid_of(setting),
            "mean": [e.mean for e in estimates],
            "low": [e.low for e in estimates],
            "high": [e.high for e in estimates],
        }
    )
