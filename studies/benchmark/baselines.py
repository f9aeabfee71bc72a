"""Baselines as jobs: every training seed of every learner on every task, with the code of other projects."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from flockesc_env.benchmark.tasks import tasks
from flockesc_env.jobs import Arrays, Job
from studies.measurements import Runner

_SECONDS = 60.0
"""Estimated processor time of a training run."""


@dataclass(frozen=True)
class Baseline:
    """A learner, the tasks on which it is trained, and the number of training seeds."""

    learner: str
    tasks: tuple[str, ...]
    seeds: int


_AGENTS = (
    "per-agent-local",
    "per-agent-visible-profile",
    "steering-predator",
    "warned-agents",
    "warned-nearest",
)

BASELINES = (
    Baseline("sb3-ppo", ("per-agent-visible", "shared"), 10),
    Baseline("sb3-ppo", (*_AGENTS, "warned-flock", "line"), 5),
    Baseline("sb3-tqc", ("shared", "warned-flock", "per-agent-visible"), 5),
)


def trainings(
    learners: Iterable[str], names: Iterable[str], most_seeds: int
) -> dict[tuple[str, str, int], Job]:
    """Return the job of every training run by learner, task and seed; empty names mean all."""
    wanted, chosen = set(learners), set(names) or set(tasks())
    return {
        (entry.learner, task, seed): Job("studies.benchmark.sb3:train", (entry.learner, task, seed), _SECONDS)
        for entry in BASELINES
        for task in entry.tasks
        for seed in range(min(entry.seeds, most_seeds))
        if task in chosen and (not wanted or entry.learner in wanted)
    }


def train_all(jobs: dict[tuple[str, str, int], Job], runner: Runner) -> dict[tuple[str, str, int], Arrays]:
    """Run the training jobs; those in the cache are not run again."""
    return runner.each(jobs, "Training")
