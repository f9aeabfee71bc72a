"""Transfer: headline policies in other worlds, against the best fixed range there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import polars as pl

from flockesc_env import FlockScenario, NamedPolicy
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import View, env_options
from flockesc_env.episodes.splits import HELD_OUT, TUNING, first_seeds
from flockesc_env.jobs import Arrays, Job
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
from studies.findings.held_out import FLOCK_GRID
from studies.findings.results import Study
from studies.findings.summary import BEST_THERE, LEARNED
from studies.measurements import Runner, chunks
from studies.playing import play_job, policy_of
from studies.robustness.plan import METERS, NEIGHBORS, attacked_presets, grid_of
from studies.tables import rows

SIZES = (100, 1_000, 10_000)
"""Numbers of agents of the paper's flock in which policies are tried."""

_SLOW_SHARE, _LARGE_SHARE = 0.2, 0.06
"""Share of the flocks for agents that count neighbors, and for more than 1,000 agents."""

_CHUNK = 50
"""Flocks of a job."""


@dataclass(frozen=True)
class Headline:
    """A policy that is tried in other worlds: its setting, its file as bytes and its objective's column."""

    setting: str
    file: bytes
    column: str


@dataclass(frozen=True)
class FixedRanges:
    """Outcomes of fixed ranges in one world by column, shape (ranges, flocks); ``flocks`` are held out.

    The ranges are numbers of neighbors if agents count neighbors.
    """

    flocks: range
    ranges: tuple[float, ...]
    tuning: Arrays
    held_out: Arrays

    def best(self, column: str) -> int:
        """Return the index of the range that is best on tuning flocks."""
        return int(self.tuning[column].mean(axis=1).argmax())


def worlds() -> dict[str, FlockScenario]:
    """Return the worlds by name: all presets of flocks with predators, and other sizes of the paper's."""
    return attacked_presets() | {f"n = {size:,}": FlockScenario(num_agents=size) for size in SIZES}


def headline(study: Study) -> Headline:
    """Return the headline policy: the best learner and training seed on tuning flocks."""
    file = study.file(study.explained, study.explained_seed)
    return Headline(study.setting, file.read_bytes(), study.spec.column)


def refusal(entry: NamedPolicy, scenario: FlockScenario) -> str | None:
    """Return why a policy cannot run in a world, as the name of the option that it needs, or ``None``."""
    try:
        FlockBatch(scenario, env_options(scenario, entry.options), view=View.of(entry.per_agent))
    except InputError as error:
        return error.field
    return None


def refusals(policy: Headline, scenarios: Mapping[str, FlockScenario]) -> dict[str, str]:
    """Return the option that is refused in every world in which a policy cannot run."""
    entry = policy_of(policy.file)
    found = {name: refusal(entry, scenario) for name, scenario in scenarios.items()}
    return {name: option for name, option in found.items() if option is not None}


def fixed_ranges(
    scenarios: Mapping[str, FlockScenario], num_flocks: int, runner: Runner
) -> dict[str, FixedRanges]:
    """Play all fixed ranges in all worlds, on held-out flocks and on twice as many tuning flocks.

    Agents that count neighbors have the grid of the robustness study, and slow worlds have fewer flocks.
    """
    flocks = {
        name: (first_seeds(TUNING, 2 * count), first_seeds(HELD_OUT, count))
        for name, scenario in scenarios.items()
        for count in [_num_flocks(scenario, num_flocks)]
    }
    jobs = {
        (name, at): seed_jobs(SWEEP, scenario, _actions(scenario), seeds)
        for name, scenario in scenarios.items()
        for at, seeds in enumerate(flocks[name])
    }
    found = runner.groups(jobs, "Fixed ranges")
    return {
        name: FixedRanges(flocks[name][1], _actions(scenario), found[name, 0], found[name, 1])
        for name, scenario in scenarios.items()
    }


def transfer(
    policies: Sequence[Headline],
    scenarios: Mapping[str, FlockScenario],
    fixed: Mapping[str, FixedRanges],
    runner: Runner,
) -> dict[str, pl.DataFrame]:
    """Return what policies and the best fixed range reach in all worlds in which a policy can run.

    A setting's table has the columns world, policy, interaction_range (null if learned), seed, objective.
    """
    jobs: dict[tuple[str, str], list[Job]] = {}
    for policy in policies:
        refused = refusals(policy, scenarios)
        for name in (name for name in scenarios if name not in refused):
            jobs[policy.setting, name] = [
                play_job(policy.file, scenarios[name], policy.column, part)
                for part in chunks(fixed[name].flocks, _CHUNK)
            ]
    played = runner.groups(jobs, "Policies in other worlds")
    columns = {policy.setting: policy.column for policy in policies}
    parts: dict[str, list[pl.DataFrame]] = {}
    for (setting, name), result in played.items():
        world, column = fixed[name], columns[setting]
        best = world.best(column)
        rho, there = world.ranges[best], world.held_out[column][best]
        parts.setdefault(setting, []).extend(
            (
                rows(world.flocks, result["objective"], world=name, policy=LEARNED, interaction_range=None),
                rows(world.flocks, there, world=name, policy=BEST_THERE, interaction_range=rho),
            )
        )
    return {setting: pl.concat(tables) for setting, tables in parts.items()}


def _actions(scenario: FlockScenario) -> tuple[float, ...]:
    own = grid_of(scenario)
    return tuple(float(rho) for rho in FLOCK_GRID) if own is METERS else own.actions


def _num_flocks(scenario: FlockScenario, num_flocks: int) -> int:
    share = _SLOW_SHARE if grid_of(scenario) is NEIGHBORS else 1.0
    share = _LARGE_SHARE if scenario.num_agents > max(SIZES[:2]) else share
    return max(round(num_flocks * share), 2)
