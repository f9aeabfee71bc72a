"""Baselines as jobs: every training seed of every learner on every task, with the code of other projects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple

from flockesc_env.jobs import Arrays, Job
from flockesc_env.models.records import versions
from flockesc_env.tasks.task import Task, tasks
from studies.measurements import Runner
from studies.scoreboard import examples, rl_zoo3, sb3

_SECONDS: Final = 60.0
"""Estimated processor time of a training run."""


class Run(NamedTuple):
    """A training run."""

    learner: str
    task: str
    seed: int


AGENT_TASKS: Final = (
    *("per-agent-visible", "per-agent-local", "per-agent-visible-profile", "steering-predator"),
    *("warned-agents", "warned-nearest"),
)
FLOCK_TASKS: Final = ("shared", "warned-flock", "line")

SEEDS: Final[Mapping[str, Mapping[str, int]]] = {
    "sb3-ppo": {**dict.fromkeys((*AGENT_TASKS, *FLOCK_TASKS), 5), "per-agent-visible": 10, "shared": 10},
    **rl_zoo3.SEEDS,
    **examples.SEEDS,
}
"""Number of training seeds by learner and task."""


def trainings(learners: Iterable[str], names: Iterable[str], most_seeds: int) -> dict[Run, Job]:
    """Return the job of every training run; empty learners or names mean all."""
    wanted, chosen = set(learners) or set(SEEDS), set(names) or set(tasks())
    return {
        Run(learner, task, seed): _job(Run(learner, task, seed))
        for learner, counts in SEEDS.items()
        for task, count in counts.items()
        for seed in range(min(count, most_seeds))
        if learner in wanted and task in chosen
    }


def train_all(jobs: Mapping[Run, Job], runner: Runner) -> dict[Run, Arrays]:
    """Run the training jobs; those in the cache are not run again."""
    return runner.each(jobs, "Training")


def hyperparameters_of(learner: str, task: Task) -> dict[str, Any]:
    """Return the hyperparameters of a learner on a task, or the command that has them."""
    if learner in rl_zoo3.SEEDS:
        return {"command": rl_zoo3.command(0)}
    if learner in examples.SEEDS:
        return {"command": examples.command(learner, 0)}
    return sb3.hyperparameters(task)


def versions_of(learner: str) -> dict[str, str]:
    """Return the versions with which a learner trains."""
    if learner in rl_zoo3.SEEDS:
        return examples.versions(rl_zoo3.PYTHON, rl_zoo3.PACKAGES)
    if learner in examples.SEEDS:
        return examples.versions_of(learner)
    return versions("torch", "stable-baselines3", "sb3-contrib")


def _job(run: Run) -> Job:
    module = next((one for one in (examples, rl_zoo3) if run.learner in one.SEEDS), sb3)
    return Job(f"{module.__name__}:train", tuple(run), _SECONDS)
