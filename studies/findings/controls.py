"""Controls of the headline policies: exchanged velocities, and blocked warnings."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np
import polars as pl
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from flockesc_env import FlockScenario, rollout, simulate, tasks
from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.episodes.predators import reset_policy
from flockesc_env.episodes.splits import HELD_OUT
from flockesc_env.jobs import Arrays
from flockesc_env.models import Trajectory
from flockesc_env.policies import BasePolicy, PolicySpec, as_policy
from flockesc_env.policies.setup import setup
from flockesc_env.taskset import Task
from studies.findings.headlines import Headline
from studies.measurements import Runner, means, play_jobs, policy_of, share_of, split, values_by, write_rows

EXCHANGED_FILE: Final = "exchanged.parquet"
BLOCKED_FILE: Final = "blocking.parquet"
EXCHANGING_FLOCKS: Final = 60
BLOCKING_FLOCKS: Final = 200

RULES: Final = ("head-away", "stubborn-leaders")  # play ``per-agent-visible`` beside the headline policies
BLOCKED: Final = (False, True)  # whether warnings are blocked
EXCHANGED: Final = ("per-agent-visible", "per-agent-local")  # whose headline policies exchange velocities


class Watched:
    """A policy whose observations and ranges are recorded, an array of all rows per action."""

    def __init__(self, policy: BasePolicy) -> None:
        self.policy, self.layout = policy, policy.policy_spec.layout
        self.observations: list[NDArray[np.float32]] = []
        self.ranges: list[FloatArray] = []

    def reset(self, rows: NDArray[np.bool]) -> None:
        """Reset the policy."""
        reset_policy(self.policy, rows)

    def act(self, observations: NDArray[np.float32], spec: PolicySpec) -> NDArray[Any]:
        """Let the policy choose."""
        actions = self.policy.act(observations, spec)
        self.observations.append(observations.copy())
        self.ranges.append(spec.actions.to_ranges(actions, len(observations)))
        return actions

    def entry(self, name: str) -> FloatArray:
        """Return an entry of the observations, shape (actions, rows)."""
        return np.array(self.observations)[..., self.layout.index(name)].astype(np.float64)


def watch(policy: BasePolicy, flocks: range) -> Watched:
    """Run a policy on some flocks of the scenario that it was trained in."""
    watched = Watched(policy)
    known: Any = {"per_agent": policy.per_agent, "scenario": policy.scenario, **vars(setup(policy).options)}
    rollout(as_policy(watched).with_options(**known), flocks, batch_size=len(flocks))
    return watched


def exchange(policy: str | bytes, scenario: FlockScenario, flocks: range) -> Arrays:
    """Return J_mean of flocks under a policy, ``played``, and ``exchanged``, as ``replay`` returns it."""
    runs = [simulate(scenario, policy=policy_of(policy), seed=seed) for seed in flocks]
    exchanged = [replay(run, np.random.default_rng(run.seed)) for run in runs]
    return {"played": np.array([run.mean_distance.min() for run in runs]), "exchanged": np.array(exchanged)}


def replay(run: Trajectory, rng: np.random.Generator | None = None) -> float:
    """Return J_mean of a flock that starts as a run and in which every agent sets the ranges of the run.

    With a random generator, the velocities that agents hear from others are exchanged among all agents in
    every step: an agent hears as many others, but not those around it. Without one, this repeats the run.
    """
    model: Any = run.scenario
    positions, velocities, means = run.positions[0], run.velocities[0], []
    for ranges, predator in zip(run.interaction_ranges, run.predator_positions[:, 0], strict=False):
        offsets = positions - predator
        distances = np.linalg.norm(offsets, axis=1, keepdims=True)
        means.append(distances.mean())
        others = velocities if rng is None else rng.permutation(velocities)
        hears = cdist(positions, positions) <= ranges[:, np.newaxis]
        heard = hears.astype(float) @ others + (velocities - others)
        force = model.speed * heard / np.linalg.norm(heard, axis=1, keepdims=True)
        force += np.where(
            distances <= model.predator_range, model.repulsion_strength * offsets / distances, 0
        )
        positions = positions + model.time_step * velocities
        velocities = velocities + model.time_step / model.mass * force
        velocities *= model.speed / np.linalg.norm(velocities, axis=1, keepdims=True)
    return float(min(means))


def measure_exchanged(headlines: Sequence[Headline], scale: float, runner: Runner, output: Path) -> None:
    """Play headline policies, a rule and the best fixed range with and without exchanged velocities."""
    flocks = share_of(HELD_OUT, EXCHANGING_FLOCKS, scale)
    played: dict[str, str | bytes] = {RULES[0]: RULES[0]}
    played |= {one.task.name: one.content for one in headlines if one.task.name in EXCHANGED}
    played["fixed"] = f"fixed:{tasks[EXCHANGED[0]].best_fixed_range:.12g}"
    jobs = {
        name: split(exchange, policy, FlockScenario(), flocks=flocks, size=20, seconds=0.3)
        for name, policy in played.items()
    }
    found = runner.run(jobs, "Exchanged velocities").items()
    write_rows(output / EXCHANGED_FILE, ({"policy": name, "seed": flocks, **one} for name, one in found))


def exchanged(output: Path) -> dict[str, tuple[Estimate, ...]]:
    """Return J_mean as played, with exchanged velocities, and the paired change, by policy."""
    groups = pl.read_parquet(output / EXCHANGED_FILE).group_by("policy", maintain_order=True)
    rows = {name: (part["played"].to_numpy(), part["exchanged"].to_numpy()) for (name,), part in groups}
    return {str(name): means([before, after, after - before]) for name, (before, after) in rows.items()}


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
        fixed = f"fixed:{task.best_fixed_range:.12g}"
        jobs[name, blocked, "objective"] = play_jobs(policy, scenario, task.spec.name, flocks)
        jobs[name, blocked, "fixed"] = play_jobs(fixed, scenario, task.spec.name, flocks)
    found, rows = runner.run(jobs, "Warnings"), []
    for name, blocked in product(played, BLOCKED):
        values = {column: found[name, blocked, column]["objective"] for column in ("objective", "fixed")}
        rows.append({"policy": name, "blocked": blocked, "seed": flocks, **values})
    write_rows(output / BLOCKED_FILE, rows)


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
