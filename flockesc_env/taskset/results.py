"""Results: a learner's policies on a task, with the objective of every flock."""

import json
import math
import re
import sys
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Final

import msgspec
import numpy as np
from msgspec import Meta

from flockesc_env.common.checks import FloatArray, as_choice, parse_json
from flockesc_env.common.errors import InputError, errors_at, shown, shown_name
from flockesc_env.common.files import suffix_of, write_text
from flockesc_env.policies.registry import NAMES, trained
from flockesc_env.policies.registry import SUFFIX as POLICY_SUFFIX
from flockesc_env.taskset.task import FLOCKS, VERSION, Task, tasks

SUFFIX: Final = ".json"

UNVERIFIED: Final = "learner, training and versions"
"""Fields of a result that no replay verifies, for example the number of samples."""

Seed = Annotated[int, Meta(ge=0, le=2**63 - 1)]
Minutes = Annotated[float, Meta(ge=0, le=sys.float_info.max)]


class PolicyResult(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A policy and the objective of every flock in every scenario of the task.

    Attributes:
        policy: path of the policy file, which lies in or below the result's folder, relative to it; the name
            of a built-in policy; or ``module:function``.
        sha256: checksum of the policy file; empty without a file.
        objectives: by scenario, one value per flock, in the order of the seeds.
    """

    policy: str
    sha256: str
    objectives: dict[str, list[float]]


class Training(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a learner was trained, in its author's words: nobody verifies it.

    Attributes:
        seeds: training seed of every policy.
        samples: number of actions of each training run.
        episodes: number of episodes of each training run; 0: not counted.
        evaluations: number of further episodes, on tuning flocks, that chose the policy or drew the curve.
        cpu_minutes: processor time of each training run.
        versions: versions of the libraries.
        hyperparameters: hyperparameters that all runs share.
    """

    seeds: list[Seed]
    samples: Annotated[int, Meta(ge=1)]
    episodes: Annotated[int, Meta(ge=0)] = 0
    evaluations: Annotated[int, Meta(ge=0)] = 0
    cpu_minutes: list[Minutes]
    versions: dict[str, str]
    hyperparameters: dict[str, Any] = {}


class Result(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The result of a learner, or of a rule, on a task.

    ``verify`` plays the policies again. Nothing verifies ``UNVERIFIED``, which the author states.

    Attributes:
        version: version of the tasks.
        task: name of the task.
        task_sha256: checksum of the task.
        flocks: first seed of the flocks, and their number.
        learner: name of the learner or rule.
        is_code: whether a policy's code is not part of the package, so that others cannot play it again.
        policies: one policy per training seed.
        training: how the learner was trained; None for a rule.
        versions: versions with which the policies were played.
    """

    version: str
    task: str
    task_sha256: str
    flocks: tuple[int, int]
    learner: str
    is_code: bool
    policies: list[PolicyResult]
    training: Training | None
    versions: dict[str, str]

    def values(self, scenario: str) -> FloatArray:
        """Return the objective in a scenario, shape (policies, flocks)."""
        return np.array([policy.objectives[scenario] for policy in self.policies])

    def scores(self) -> FloatArray:
        """Return the normalized score of every policy, shape (policies,)."""
        task = tasks[self.task]
        scores: FloatArray = task.normalize({name: self.values(name).mean(axis=1) for name in task.scales})
        return scores


def write_result(result: Result, path: Path) -> None:
    """Write a result to a JSON file, a line per policy, with floats at full precision."""
    document = msgspec.to_builtins(result)
    rows = ",\n  ".join(json.dumps(policy) for policy in document.pop("policies"))
    head = json.dumps(document, indent=1).removesuffix("\n}")
    write_text(path, f'{head},\n "policies": [\n  {rows}\n ]\n}}\n')


def read_result(path: Path) -> Result:
    """Read a result, and check everything that needs no replay.

    A file that is damaged, or about tasks or flocks of another version, raises ``InputError``.
    """
    try:
        result = msgspec.convert(parse_json(path.read_text("utf-8")), Result)
    except (ValueError, msgspec.ValidationError) as error:
        raise InputError(str(path), "a result on a task", error) from None
    with errors_at(f"{path}: "):
        _check(result)
    return result


def check_learner(name: str) -> None:
    """Check the name of a learner, which gets into tables and names of folders."""
    if not re.fullmatch(r"[\w.+:-]+", name, re.ASCII):
        raise InputError("learner", "letters, digits and _ . + : -", shown(name))


def is_file(policy: str) -> bool:
    """Return whether the text that names a policy is the path of a policy file."""
    return suffix_of(policy) == POLICY_SUFFIX


def is_code(policy: str) -> bool:
    """Return whether the text that names a policy is its author's code, such as ``module:function``."""
    return ":" in policy and not is_file(policy) and not policy.startswith("fixed:")


def is_below(policy: str) -> bool:
    """Return whether the path of a policy file is in or below the result's folder, spelled in one way."""
    path = PurePosixPath(policy)
    return not path.is_absolute() and ".." not in path.parts and str(path) == policy


def check_source(policy: str, sha256: str) -> None:
    """Check where a result says that a policy comes from: one text per file, below the result's folder."""
    pattern, expected = "", "no checksum for a policy without a file"
    if is_file(policy):
        if not is_below(policy):
            place = "a relative path of a file in or below the result's folder, such as policies/ppo-0.npz"
            raise InputError("policy", place, shown(policy))
        pattern, expected = r"[0-9a-f]{64}", "64 hexadecimal digits"
    elif not (":" in policy or policy in NAMES or policy in trained()):
        expected = "a policy file below the result's folder (.npz), the name of a policy, or module:function"
        raise InputError("policy", expected, shown_name(policy, NAMES))
    if not re.fullmatch(pattern, sha256):
        raise InputError("sha256", expected, shown(sha256))


def check_different(policies: Sequence[PolicyResult], task: Task) -> None:
    """Check that the last policy is none of those before it: equal objectives on all flocks are one policy.

    Policies with the score 0.000 may be equal: trainings start at the best fixed range, and some end there.
    """
    *others, own = policies
    means = {name: float(np.mean(values)) for name, values in own.objectives.items()}
    is_start = abs(task.normalize(means)) < 0.0005
    for other in others:
        is_same = (other.sha256 or other.policy) == (own.sha256 or own.policy)
        if is_same or (own.objectives == other.objectives and not is_start):
            given = f"one of them twice ({other.policy} and {own.policy})"
            raise InputError("policies", "policies that differ on some flock (list equal ones once)", given)


def check_training(training: Training | None, policies: int) -> None:
    """Check that there is one training seed and one time per policy."""
    if training is None:
        return
    if not len(set(training.seeds)) == len(training.seeds) == policies:
        raise InputError("training.seeds", f"{policies} different seeds, one per policy", training.seeds)
    if len(training.cpu_minutes) != policies:
        raise InputError("training.cpu_minutes", f"{policies} numbers, one per policy", training.cpu_minutes)


def _check(result: Result) -> None:
    if result.version != VERSION:
        raise InputError("version", VERSION, shown(result.version))
    check_learner(result.learner)
    task = tasks[as_choice(result.task, "task", tasks)]
    if result.task_sha256 != task.sha256:
        raise InputError("task_sha256", f"{task.sha256}, of the task {task.name}", shown(result.task_sha256))
    flocks = (FLOCKS.start, len(FLOCKS))
    if result.flocks != flocks:
        raise InputError("flocks", f"first seed and number {flocks}", result.flocks)
    if not result.policies:
        raise InputError("policies", "at least one", "none")
    for index, policy in enumerate(result.policies):
        with errors_at(f"policies[{index}]."):
            check_source(policy.policy, policy.sha256)
            _check_objectives(policy, task)
        check_different(result.policies[: index + 1], task)
    is_played_by_code = any(is_code(policy.policy) for policy in result.policies)
    if result.is_code is not is_played_by_code:
        raise InputError("is_code", f"{is_played_by_code}, as its policies are", result.is_code)
    check_training(result.training, len(result.policies))


def _check_objectives(policy: PolicyResult, task: Task) -> None:
    if set(policy.objectives) != set(task.scales):
        expected = f"the scenarios {', '.join(task.scales)}"
        raise InputError("objectives", expected, ", ".join(policy.objectives))
    for name, values in policy.objectives.items():
        finite, given = sum(map(math.isfinite, values)), len(values)
        if not finite == given == len(FLOCKS):
            expected = f"{len(FLOCKS)} finite numbers"
            raise InputError(f"objectives.{name}", expected, f"{finite} finite of {given}")
