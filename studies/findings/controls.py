"""Controls of the headline policies: hidden entries of the observation, and blocked warnings."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from flockesc_env import Policy, rollout, tasks
from flockesc_env.common.array_files import write_table
from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.episodes.predators import reset_policy
from flockesc_env.episodes.spaces import ObservationLayout
from flockesc_env.episodes.splits import HELD_OUT, TUNING
from flockesc_env.jobs import Arrays, Job
from flockesc_env.policies import BasePolicy, PolicySpec, as_policy
from flockesc_env.policies.setup import setup
from flockesc_env.taskset import Task
from studies.findings.headlines import Headline
from studies.measurements import Runner, play_jobs, policy_of, share_of, values_by
from studies.scoreboard.board import best_fixed_range

Observations = NDArray[np.float32]

HIDDEN_FILE: Final = "ablation.parquet"
BLOCKED_FILE: Final = "blocking.parquet"
HIDING_FLOCKS: Final = 100
BLOCKING_FLOCKS: Final = 200
TUNED: Final = 20  # tuning flocks over which a hidden entry has its mean

RULES: Final = ("head-away", "stubborn-leaders")  # play ``per-agent-visible`` beside the headline policies
BLOCKED: Final = (False, True)  # whether warnings are blocked
NOTHING: Final = "nothing"

GROUPS: Final[dict[str, tuple[str, ...]]] = {
    "time": ("time",),
    "escape direction": ("escape_", "heard_escape_gain", "heading_escape"),
    "closest approach": ("closest_", "heard_closest_approach"),
    "predator direction": ("predator_direction", "heading_away", "velocity_away"),
    "predator distance": ("predator_distance", "mean_distance", "min_distance", "centroid_distance"),
    "predator velocity": ("predator_velocity", "predator_speed", "predator_aim"),
    "heard velocity": ("heard_velocity", "velocity_ahead", "velocity_left"),
    "number of neighbors": ("neighbor_count",),
    "alignment": ("polarization", "heard_alignment"),
    "last range": ("last_range",),
    "running minimum": ("running_minimum",),
}
"""Entries of an observation that are hidden together, by the beginnings of their names.

The entries of candidate ranges belong to them without ``profile_k_``.
"""


@dataclass
class Hiding:
    """A policy that sees a constant instead of each entry in a column of ``shown``."""

    policy: Policy
    shown: dict[int, float]

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Reset the policy."""
        reset_policy(self.policy, rows)

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Let the policy choose without the hidden entries."""
        seen = observations.copy()
        for column, value in self.shown.items():
            seen[:, column] = value
        return self.policy.act(seen, spec)


class Watching(Hiding):
    """A policy whose observations and ranges are recorded."""

    def __init__(self, policy: Policy) -> None:
        super().__init__(policy, {})
        self.seen: list[Observations] = []
        self.ranges: list[FloatArray] = []

    def act(self, observations: Observations, spec: PolicySpec) -> NDArray[Any]:
        """Let the policy choose."""
        actions = super().act(observations, spec)
        self.seen.append(observations.copy())
        self.ranges.append(spec.actions.to_ranges(actions, len(observations)))
        return actions


class Watched(NamedTuple):
    """Observations of a policy, shape (actions, rows, entries), and ranges in m, shape (actions, rows)."""

    layout: ObservationLayout
    observations: Observations
    ranges: FloatArray

    def entry(self, name: str) -> FloatArray:
        """Return an entry of the observations, shape (actions, rows)."""
        return self.observations[..., self.layout.index(name)].astype(np.float64)


def watch(policy: BasePolicy, flocks: range) -> Watched:
    """Run a policy on some flocks of the scenario that it was trained in."""
    watching = Watching(policy)
    rollout(_instead(watching, policy), flocks, batch_size=len(flocks))
    return Watched(policy.policy_spec.layout, np.array(watching.seen), np.array(watching.ranges))


def hide(policy: bytes, column: str, shown: tuple[tuple[int, float], ...], flocks: range) -> Arrays:
    """Return the objective of every flock under a policy that sees some columns as constants."""
    found = policy_of(policy)
    episodes = rollout(_instead(Hiding(found, dict(shown)), found), flocks)
    return {"objective": getattr(episodes, column)}


def _instead(policy: Policy, replaced: BasePolicy) -> BasePolicy:
    """Return a policy with the view, the scenario and the options of another one."""
    known: Any = {"per_agent": replaced.per_agent, "scenario": replaced.scenario}
    return as_policy(policy).with_options(**known, **vars(setup(replaced).options))


def measure_hidden(headlines: Sequence[Headline], scale: float, runner: Runner, output: Path) -> None:
    """Play the headline policies with groups of entries replaced by their means over tuning flocks."""
    flocks = share_of(HELD_OUT, HIDING_FLOCKS, scale)
    jobs = {}
    for headline in headlines:
        watched = watch(headline.entry, share_of(TUNING, TUNED, scale))
        means = watched.observations.reshape(-1, watched.observations.shape[-1]).mean(axis=0)
        names = [re.sub(r"^profile_\d+_", "", name) for name in watched.layout.names]
        for group, beginnings in {NOTHING: (), **GROUPS}.items():
            shown = [(k, float(means[k])) for k, name in enumerate(names) if name.startswith(beginnings)]
            if shown or group == NOTHING:
                arguments = (headline.content, headline.task.spec.name, tuple(shown), flocks)
                jobs[headline.task.name, group] = Job(f"{__name__}:hide", arguments, len(flocks) * 0.05)
    tables = [
        pl.DataFrame({"task": task, "removed": group, "seed": flocks, **found})
        for (task, group), found in runner.run(jobs, "Hidden entries").items()
    ]
    write_table(pl.concat(tables), output / HIDDEN_FILE)


def changes(output: Path) -> dict[str, dict[str, Estimate]]:
    """Return the paired change of the objective by task and hidden group, in the order of ``GROUPS``."""
    values = values_by(pl.read_parquet(output / HIDDEN_FILE), "task", "removed")
    return {
        task: {group: mean(values[task, group] - whole) for group in GROUPS if (task, group) in values}
        for (task, removed), whole in values.items()
        if removed == NOTHING
    }


def measure_blocked(headlines: Sequence[Headline], scale: float, runner: Runner, output: Path) -> None:
    """Play the headline policies, ``RULES`` and the best fixed ranges, with and without warnings.

    The table has the columns policy (a task or a rule), blocked, seed, and objective and fixed in m. The best
    fixed range of each task was chosen with warnings.
    """
    flocks = share_of(HELD_OUT, BLOCKING_FLOCKS, scale)
    played: dict[str, tuple[Any, Task]] = {one.task.name: (one.content, one.task) for one in headlines}
    played |= {rule: (rule, tasks["per-agent-visible"]) for rule in RULES}
    jobs = {}
    for (name, (policy, task)), blocked in product(played.items(), BLOCKED):
        scenario: Any = task.scenario.replace(blocks_warnings=blocked)
        fixed = f"fixed:{best_fixed_range(task):.12g}"
        jobs[name, blocked, "objective"] = play_jobs(policy, scenario, task.spec.name, flocks)
        jobs[name, blocked, "fixed"] = play_jobs(fixed, scenario, task.spec.name, flocks)
    found = runner.run(jobs, "Warnings")
    tables = []
    for name, blocked in product(played, BLOCKED):
        values = {column: found[name, blocked, column]["objective"] for column in ("objective", "fixed")}
        tables.append(pl.DataFrame({"policy": name, "blocked": blocked, "seed": flocks, **values}))
    write_table(pl.concat(tables), output / BLOCKED_FILE)


def estimates(output: Path) -> dict[str, dict[str, Estimate]]:
    """Return estimates in m for every task and rule in the table of ``measure_blocked``.

    ``hearing`` and ``blocked`` are the policy's objective with and without warnings, ``warning`` their paired
    difference. ``gain_hearing`` and ``gain_blocked`` are the paired gains over the best fixed range.
    """
    table = pl.read_parquet(output / BLOCKED_FILE).with_columns(gain=pl.col("objective") - pl.col("fixed"))
    objective = values_by(table, "policy", "blocked", column="objective")
    gain = values_by(table, "policy", "blocked", column="gain")
    return {
        name: {
            "hearing": mean(objective[name, False]),
            "blocked": mean(objective[name, True]),
            "warning": mean(objective[name, False] - objective[name, True]),
            "gain_hearing": mean(gain[name, False]),
            "gain_blocked": mean(gain[name, True]),
        }
        for name in table["policy"].unique(maintain_order=True)
    }
