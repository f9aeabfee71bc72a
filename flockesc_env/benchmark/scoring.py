"""``score`` and ``verify``: play policies on the held-out flocks of a task, and play a result again."""

from __future__ import annotations

import dataclasses
import hashlib
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from flockesc_env.benchmark.fitting import fitted, is_checkable
from flockesc_env.benchmark.results import PolicyResult, Result, Training, check_seeds, read_result
from flockesc_env.benchmark.tasks import FLOCKS, VERSION, Task, task_of
from flockesc_env.common.checks import FloatArray, as_count
from flockesc_env.common.errors import ArgumentError, RecordError
from flockesc_env.models.records import versions
from flockesc_env.policies.files import SUFFIX, find_policy
from flockesc_env.policies.ranges import RandomRange
from flockesc_env.policies.registry import NamedPolicy
from flockesc_env.policies.rollout import rollout
from flockesc_env.scenario.flock import FlockScenario

_SHOWN: Final = 3
"""Flocks that the error about a difference names."""

Report = Callable[[str], None]


def play(entry: NamedPolicy, task: Task, world: str, flocks: Sequence[int]) -> FloatArray:
    """Play a policy with its own options in a world of a task; return the objective, shape (flocks,)."""
    scenario = task.scenarios[world]
    options = {"objective": task.spec.name} if isinstance(scenario, FlockScenario) else {}
    entry = dataclasses.replace(entry, options={**options, **entry.options})
    return task.spec.values(rollout(scenario, entry, flocks))


def score(
    policies: Sequence[tuple[str, NamedPolicy]],
    task: Task,
    *,
    learner: str,
    output: Path,
    training: Training | None = None,
    report: Report = lambda _: None,
) -> Result:
    """Play the policies of a learner on the held-out flocks of a task.

    Args:
        policies: every policy with the text that names it: the path of a policy file, the name of a built-in
            policy, or ``module:function``.
        task: the task.
        learner: name of the learner or rule.
        output: path of the result, which is not written; the result names files relative to its folder.
        training: how the learner was trained.
        report: called with the name of every policy before it plays.

    Raises:
        ArgumentError: if a policy does not fit the task, or the training seeds are not one per policy.
    """
    check_seeds(training, len(policies))
    fitting = []
    for spec, entry in policies:
        try:
            fitting.append((spec, fitted(entry, task)))
        except ArgumentError as error:
            raise ArgumentError(f"{spec}: {error.field}", error.expected, error.given) from None
    found = []
    for spec, entry in fitting:
        report(spec)
        is_file = spec.endswith(SUFFIX)
        objectives = {world: play(entry, task, world, FLOCKS).tolist() for world in task.worlds}
        found.append(
            PolicyResult(
                policy=_relative(Path(spec), output.parent) if is_file else spec,
                sha256=_sha256(Path(spec)) if is_file else "",
                objectives=objectives,
            )
        )
    return Result(
        benchmark=VERSION,
        task=task.name,
        task_sha256=task.sha256,
        flocks=(FLOCKS.start, len(FLOCKS)),
        learner=learner,
        is_code=not all(_is_reproducible(spec, entry) for spec, entry in policies),
        policies=found,
        training=training,
        versions=versions(),
    )


def verify(path: Path, *, flocks: int | None = None, report: Report = lambda _: None) -> Result:
    """Play a result again and compare every objective, bit for bit; return the result.

    Args:
        path: path of the result. Policy files lie relative to it.
        flocks: number of flocks to play, drawn by the result's checksum; None: all.
        report: called with the name of every policy before it plays.

    Raises:
        ArgumentError: if ``flocks`` is below 1.
        RecordError: if the result is not about this version's tasks and flocks, a policy file has another
            checksum, a policy does not fit the task, an objective differs, or the policies are code.
    """
    result = read_result(path)
    task = task_of(result.task)
    drawn = _draw(path, flocks)
    for index, policy in enumerate(result.policies):
        field = f"{path}: policies[{index}]"
        entry = _find(policy, path.parent, field)
        report(policy.policy)
        try:
            entry = fitted(entry, task)
        except ArgumentError as error:
            raise RecordError(f"{field}: {error.field}", error.expected, error.given) from None
        for world, recorded in policy.objectives.items():
            played = _played(entry, task, world, drawn)
            given = np.array(recorded)[drawn]
            differs = np.flatnonzero(played.view(np.int64) != given.view(np.int64))
            if len(differs):
                named = ", ".join(
                    f"flock {FLOCKS[drawn[at]]}: {float(given[at])!r}, played {float(played[at])!r}"
                    for at in differs[:_SHOWN]
                )
                expected = f"objectives in {world} with the bits that {policy.policy} reaches"
                raise RecordError(field, expected, f"{len(differs)} of {len(drawn)} others ({named})")
    return result


def _played(entry: NamedPolicy, task: Task, world: str, drawn: Sequence[int]) -> FloatArray:
    """Return the objectives of some flocks; the numbers of a random policy depend on all flocks before."""
    if isinstance(entry.policy, RandomRange):
        return play(entry, task, world, FLOCKS)[drawn]
    return play(entry, task, world, [FLOCKS[at] for at in drawn])


def _find(policy: PolicyResult, folder: Path, field: str) -> NamedPolicy:
    """Return the policy of a result, after a check of its file."""
    if not policy.policy.endswith(SUFFIX):
        try:
            entry = find_policy(policy.policy)
        except ArgumentError:
            expected = "a policy file or a built-in policy, which can be played again"
            raise RecordError(field, expected, f"{policy.policy!r}, played by its author's code") from None
        return entry
    path = folder / policy.policy
    if not path.is_file():
        raise RecordError(field, "an existing policy file", repr(policy.policy))
    found = _sha256(path)
    if found != policy.sha256:
        raise RecordError(field, f"{policy.policy} with the sha256 {policy.sha256}", found)
    return find_policy(str(path))


def _is_reproducible(spec: str, entry: NamedPolicy) -> bool:
    """Return whether others can play a policy: it is a file or built-in, and computes rows one by one."""
    is_given = spec.endswith(SUFFIX) or ":" not in spec or spec.startswith("fixed:")
    return is_given and is_checkable(entry.policy)


def _draw(path: Path, flocks: int | None) -> list[int]:
    """Return indices of flocks: all, or some that depend on every byte of the result."""
    if flocks is None or as_count(flocks, "flocks") >= len(FLOCKS):
        return list(range(len(FLOCKS)))
    seed = int.from_bytes(hashlib.sha256(path.read_bytes()).digest()[:8])
    chosen = np.random.default_rng(seed).choice(len(FLOCKS), flocks, replace=False)
    return sorted(chosen.tolist())


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
