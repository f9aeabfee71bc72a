"""Transfer: headline policies in other worlds, against the best fixed range there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from flockesc_env import FlockScenario, NamedPolicy, rollout
from flockesc_env.common.errors import InputError
from flockesc_env.common.stats import FloatArray
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import env_options
from flockesc_env.jobs import Arrays, Backend, Cache, Job
from flockesc_env.jobs.sweeps import OUTCOMES as SWEEP
from flockesc_env.jobs.sweeps import seed_jobs
from studies.learned.held_out import FLOCK_GRID, stored_policy
from studies.learned.results import POLICIES, Study
from studies.learned.summary import BEST_THERE, LEARNED
from studies.measurements import run_groups
from studies.robustness.plan import METERS, NEIGHBORS, attacked_presets, grid_of
from training import seeds

SIZES = (100, 1_000, 10_000)
"""Numbers of agents of the paper's flock in which policies are tried."""

_SLOW_SHARE, _LARGE_SHARE = 0.2, 0.06
"""Share of the flocks for agents that count neighbors, and for more than 1,000 agents."""

_CHUNK = 50
"""Flocks of a job."""

_AGENT_STEP = 500e-9
"""Estimated time of a step of an agent under a policy in s."""

Table = dict[str, pl.DataFrame]


@dataclass(frozen=True)
class Headline:
    """A policy that is tried in other worlds.

    Attributes:
        setting: name of the setting in which it was trained.
        file: the bytes of its file.
        column: its objective in the results of sweeps and rollouts.
    """

    setting: str
    file: bytes
    column: str


@dataclass(frozen=True)
class FixedRanges:
    """Fixed ranges of one world, played exactly.

    Attributes:
        flocks: seeds of the held-out flocks.
        ranges: in rising order; numbers of neighbors if agents count neighbors.
        tuning: outcomes on tuning flocks by column, shape (ranges, flocks).
        held_out: outcomes on the held-out flocks by column, shape (ranges, flocks).
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


def headline(study: Study, results: Path) -> Headline:
    """Return the headline policy: of the best learner on tuning flocks, the training seed that is best there.

    Args:
        study: results of a setting of a flock.
        results: folder of all settings.
    """
    name = f"{study.explained or study.best_learner}-{best_seed(study)}"
    file = (results / study.setting / POLICIES / f"{name}.npz").read_bytes()
    return Headline(study.setting, file, study.spec.column)


def best_seed(study: Study) -> int:
    """Return the training seed of the headline policy."""
    return study.best_seed if study.explained_seed is None else study.explained_seed


def refusal(entry: NamedPolicy, scenario: FlockScenario) -> str | None:
    """Return why a policy cannot run in a world, as the name of the option that it needs, or ``None``."""
    try:
        FlockBatch(scenario, env_options(scenario, entry.options), per_agent=entry.per_agent)  # type: ignore[arg-type]
    except InputError as error:
        return error.field
    return None


def fixed_ranges(
    scenarios: Mapping[str, FlockScenario],
    flocks: int,
    cache: Cache,
    backend: Backend,
) -> dict[str, FixedRanges]:
    """Play all fixed ranges in all worlds, on held-out flocks and on twice as many tuning flocks.

    Agents that count neighbors have the grid of the robustness study.

    Args:
        scenarios: the worlds by name.
        flocks: number of held-out flocks; slow worlds have fewer.
        cache: of the measurements; all policies share them.
        backend: where they run.
    """
    jobs: dict[str, list[Job]] = {}
    for name, scenario in scenarios.items():
        count = _num_flocks(scenario, flocks)
        for purpose, num in ((seeds.TUNING, 2 * count), (seeds.HELD_OUT, count)):
            chosen = seeds.first_seeds(purpose, num)
            jobs[_key(name, purpose)] = seed_jobs(SWEEP, scenario, _actions(scenario), chosen)
    found = run_groups(jobs, cache, backend, title="Fixed ranges")
    return {
        name: FixedRanges(
            seeds.first_seeds(seeds.HELD_OUT, _num_flocks(scenario, flocks)),
            _actions(scenario),
            found[_key(name, seeds.TUNING)],
            found[_key(name, seeds.HELD_OUT)],
        )
        for name, scenario in scenarios.items()
    }


def transfer(
    policies: Sequence[Headline],
    scenarios: Mapping[str, FlockScenario],
    fixed: Mapping[str, FixedRanges],
    cache: Cache,
    backend: Backend,
) -> Table:
    """Return what policies and the best fixed range reach in all worlds in which a policy can run.

    Args:
        policies: the policies.
        scenarios: the worlds by name.
        fixed: fixed ranges of all worlds.
        cache: of the measurements.
        backend: where they run.

    Returns:
        A table per setting: world, policy, interaction_range (null if learned), seed, objective.
    """
    pairs = [
        (policy, name)
        for policy in policies
        for name, scenario in scenarios.items()
        if refusal(stored_policy(policy.file), scenario) is None
    ]
    jobs = {
        f"{policy.setting} in {name}": _in_world_jobs(policy, scenarios[name], fixed[name].flocks)
        for policy, name in pairs
    }
    played = run_groups(jobs, cache, backend, title="Policies in other worlds")
    parts: dict[str, list[pl.DataFrame]] = {policy.setting: [] for policy in policies}
    for policy, name in pairs:
        best, flocks = fixed[name].best(policy.column), fixed[name].flocks
        learned = played[f"{policy.setting} in {name}"]["objective"][0]
        there = fixed[name].held_out[policy.column][best]
        parts[policy.setting] += [
            _rows(name, LEARNED, None, flocks, learned),
            _rows(name, BEST_THERE, fixed[name].ranges[best], flocks, there),
        ]
    return {setting: pl.concat(tables) for setting, tables in parts.items() if tables}


def refusals(policy: Headline, scenarios: Mapping[str, FlockScenario]) -> Iterator[tuple[str, str]]:
    """Yield the worlds in which a policy cannot run, each with the option that is refused."""
    entry = stored_policy(policy.file)
    for name, scenario in scenarios.items():
        if (reason := refusal(entry, scenario)) is not None:
            yield name, reason


def in_world(file: bytes, column: str, scenario: FlockScenario, flocks: range) -> Arrays:
    """Return the objective under the policy in the bytes of a file, shape (1, flocks)."""
    return {"objective": getattr(rollout(scenario, stored_policy(file), flocks), column)[None]}


def _in_world_jobs(policy: Headline, scenario: FlockScenario, flocks: range) -> list[Job]:
    slowness = 30 if grid_of(scenario) is NEIGHBORS else 1
    seconds = _CHUNK * scenario.num_steps * scenario.num_agents * _AGENT_STEP * slowness
    chunks = [flocks[start : start + _CHUNK] for start in range(0, len(flocks), _CHUNK)]
    arguments = [(policy.file, policy.column, scenario, chunk) for chunk in chunks]
    return [Job(f"{__name__}:in_world", one, seconds) for one in arguments]


def _rows(world: str, policy: str, fixed: float | None, flocks: range, values: FloatArray) -> pl.DataFrame:
    labels = {"world": world, "policy": policy, "interaction_range": fixed}
    types = {"world": pl.String, "policy": pl.String, "interaction_range": pl.Float64}
    columns = {name: [label] * len(flocks) for name, label in labels.items()}
    numbers = {"seed": flocks, "objective": values}
    return pl.DataFrame({**columns, **numbers}, {**types, "seed": pl.Int64, "objective": pl.Float64})


def _actions(scenario: FlockScenario) -> tuple[float, ...]:
    own = grid_of(scenario)
    return tuple(float(rho) for rho in FLOCK_GRID) if own is METERS else own.actions


def _num_flocks(scenario: FlockScenario, flocks: int) -> int:
    share = _SLOW_SHARE if grid_of(scenario) is NEIGHBORS else 1.0
    share = _LARGE_SHARE if scenario.num_agents > max(SIZES[:2]) else share
    return max(round(flocks * share), 2)


def _key(world: str, purpose: range) -> str:
    return f"{world}, seeds from {purpose.start}"
