"""Whether a reward sees what is scored: the gain of agents with one range over agents with another.

``own``: half of the agents hold range A for an episode, the others B. The gain is the mean return of the
reward ``"individual"`` with A minus that with B. Every flock is played twice, with exchanged roles.
``team``: the objective if all hold A minus that if all hold B. Where the signs differ, the individual reward
teaches a range that harms the flock: a social dilemma.
"""

from dataclasses import astuple
from pathlib import Path
from typing import Any, Final

import numpy as np

from flockesc_env.common.files import write_text
from flockesc_env.common.stats import Estimate, FloatArray, mean
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.splits import TUNING
from flockesc_env.jobs import Arrays
from flockesc_env.taskset.task import Task, tasks
from studies.measurements import Runner, sign, split
from studies.scoreboard.trainings import TRANSFERRED
from studies.study import document

FILE: Final = Path("results/scoreboard/rewards.json")
FLOCKS: Final = TUNING[3000:4000]  # tuning flocks that nothing else is chosen or measured on


def write(runner: Runner, file: Path = FILE) -> None:
    """Measure the pairs of every task with one range per agent on which people train."""
    pairs = {(name, *pair): pair for name, task in tasks.items() for pair in pairs_of(task)}
    jobs = {key: split(gains, *key, flocks=FLOCKS, size=50, seconds=0.1) for key in pairs}
    rows: dict[str, list[Any]] = {}
    for (name, a, b), found in runner.run(jobs, "Gains").items():
        gains = {kind: astuple(mean(values)) for kind, values in found.items()}
        rows.setdefault(name, []).append({"a": a, "b": b, **gains})
    write_text(file, document(rows))


def is_opposite(row: dict[str, Any]) -> bool:
    """Return whether both intervals of a pair exclude 0, with opposite signs."""
    return sign(Estimate(*row["own"])) * sign(Estimate(*row["team"])) < 0


def pairs_of(task: Task) -> list[tuple[float, float]]:
    """Return the best fixed range, as far as an action sets it, with 0 and with the largest or half of it."""
    if not task.per_agent or task.name in TRANSFERRED:
        return []
    largest = float(task.options["max_range"])
    best = min(task.best_fixed_range, largest)
    other = largest if best < largest else largest / 2
    return [(best, 0.0), (best, other)]


def gains(name: str, a: float, b: float, flocks: range) -> Arrays:
    """Return ``own`` and ``team`` of the ranges ``a`` and ``b``, in m, shape (flocks,)."""
    count = tasks[name].scenario.num_agents
    half = np.array([np.random.default_rng(seed).permutation(count) < count // 2 for seed in flocks])
    own = []
    for holds_a in (half, ~half):
        returns, _ = _play(name, np.where(holds_a, a, b), flocks)
        own.append(returns.mean(axis=1, where=holds_a) - returns.mean(axis=1, where=~holds_a))
    _, all_a = _play(name, np.full(half.shape, a), flocks)
    _, all_b = _play(name, np.full(half.shape, b), flocks)
    return {"own": np.mean(own, axis=0), "team": all_a - all_b}


def _play(name: str, ranges: FloatArray, flocks: range) -> tuple[FloatArray, FloatArray]:
    """Return the return of every agent, shape (flocks, agents), and the objective of every flock, in m.

    ``ranges`` are those that the agents hold, shape (flocks, agents).
    """
    task: Any = tasks[name]
    options = task.scenario.env_options({**task.options, "reward": "individual", "action_mode": "range"})
    batch = FlockBatch(task.scenario, options, num_flocks=len(flocks), per_agent=True, num_threads=1)
    batch.reset(range(len(flocks)), list(flocks))
    returns = np.zeros(ranges.size)
    has_ended = np.zeros(1, bool)
    while not has_ended.all():
        _, rewards, has_ended, *_ = batch.step(ranges.reshape(-1, 1), at_end="stay")
        returns += rewards
    return returns.reshape(ranges.shape), batch.core.metrics()[task.spec.name]
