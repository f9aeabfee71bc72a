"""Results of the benchmark: a learner's policies on a task, with the objective of every flock."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from flockesc_env.benchmark.tasks import FLOCKS, VERSION, Task, task_of
from flockesc_env.common.checks import FloatArray
from flockesc_env.common.errors import ArgumentError, RecordError, shown
from flockesc_env.common.files import write_text
from flockesc_env.common.json_text import parse_json

SUFFIX: Final = ".json"


class PolicyResult(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A policy and the objective of every flock in every world.

    Attributes:
        policy: path of the policy file relative to the result, the name of a built-in policy, or
            ``module:function``.
        sha256: checksum of the policy file; empty without a file.
        objectives: by world, one value per flock, in the order of the seeds.
    """

    policy: str
    sha256: str
    objectives: dict[str, list[float]]


class Training(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a learner was trained.

    Attributes:
        seeds: training seed of every policy.
        samples: number of actions of each training run.
        cpu_minutes: processor time of each training run.
        versions: versions of the libraries.
        hyperparameters: hyperparameters that all runs share.
    """

    seeds: list[int]
    samples: int
    cpu_minutes: list[float]
    versions: dict[str, str]
    hyperparameters: dict[str, Any] = {}


class Result(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The result of a learner, or of a rule, on a task.

    Attributes:
        benchmark: version of the benchmark.
        task: name of the task.
        task_sha256: checksum of the task.
        flocks: first seed of the flocks, and their number.
        learner: name of the learner or rule.
        is_code: whether a policy's code is not part of the package, so that others cannot play it again.
        policies: one policy per training seed.
        training: how the learner was trained; None for a rule.
        versions: versions with which the policies were played.
    """

    benchmark: str
    task: str
    task_sha256: str
    flocks: tuple[int, int]
    learner: str
    is_code: bool
    policies: list[PolicyResult]
    training: Training | None
    versions: dict[str, str]

    def values(self, world: str) -> FloatArray:
        """Return the objective in a world, shape (policies, flocks)."""
        return np.array([policy.objectives[world] for policy in self.policies])

    def scores(self) -> FloatArray:
        """Return the normalized score of every policy, shape (policies,)."""
        task = task_of(self.task)
        means = {world: self.values(world).mean(axis=1) for world in task.worlds}
        return np.array(
            [task.score({w: float(means[w][at]) for w in means}) for at in range(len(self.policies))]
        )


def write_result(result: Result, path: Path) -> None:
    """Write a result to a JSON file, a line per policy and world, with floats at full precision."""
    document = msgspec.to_builtins(result)
    policies = document.pop("policies")
    text = json.dumps({**document, "policies": []}, indent=1)
    rows = ",\n  ".join(json.dumps(policy) for policy in policies)
    write_text(path, text.replace('"policies": []', f'"policies": [\n  {rows}\n ]') + "\n")


def read_result(path: Path) -> Result:
    """Read a result, and check everything that needs no replay.

    Raises:
        FileNotFoundError: if the file does not exist.
        RecordError: if the file is damaged, or is not about the tasks and flocks of this version.
    """
    try:
        result = msgspec.convert(parse_json(path.read_text("utf-8")), Result)
    except (ValueError, msgspec.ValidationError) as error:
        raise RecordError(str(path), "a result of the benchmark", error) from None
    try:
        _check(result)
    except ArgumentError as error:
        raise RecordError(f"{path}: {error.field}", error.expected, error.given) from None
    return result


def check_learner(name: str) -> None:
    """Check the name of a learner, which gets into tables and names of folders."""
    if not re.fullmatch(r"[\w.+:-]+", name, re.ASCII):
        raise ArgumentError("learner", "letters, digits and _ . + : -", shown(name))


def _check(result: Result) -> None:
    if result.benchmark != VERSION:
        raise ArgumentError("benchmark", VERSION, shown(result.benchmark))
    check_learner(result.learner)
    task = task_of(result.task)
    if result.task_sha256 != task.sha256:
        raise ArgumentError(
            "task_sha256", f"{task.sha256}, of the task {task.name}", shown(result.task_sha256)
        )
    flocks = (FLOCKS.start, len(FLOCKS))
    if result.flocks != flocks:
        raise ArgumentError("flocks", f"first seed and number {flocks}", result.flocks)
    if not result.policies:
        raise ArgumentError("policies", "at least one", "none")
    for index, policy in enumerate(result.policies):
        _check_objectives(policy, task, f"policies[{index}].objectives")
    sums = [policy.sha256 or policy.policy for policy in result.policies]
    if len(set(sums)) < len(sums):
        raise ArgumentError("policies", "different policies", "one of them twice")
    check_seeds(result.training, len(sums))


def check_seeds(training: Training | None, policies: int) -> None:
    """Refuse a training whose seeds are not one per policy."""
    if training and not len(set(training.seeds)) == len(training.seeds) == policies:
        raise ArgumentError("training.seeds", f"{policies} different seeds, one per policy", training.seeds)


def _check_objectives(policy: PolicyResult, task: Task, field: str) -> None:
    if set(policy.objectives) != set(task.worlds):
        raise ArgumentError(field, f"the worlds {', '.join(task.worlds)}", ", ".join(policy.objectives))
    for world, values in policy.objectives.items():
        finite, given = sum(map(math.isfinite, values)), len(values)
        if not finite == given == len(FLOCKS):
            raise ArgumentError(
                f"{field}.{world}", f"{len(FLOCKS)} finite numbers", f"{finite} finite of {given}"
            )
