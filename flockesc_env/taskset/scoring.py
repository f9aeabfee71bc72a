"""``score`` and ``verify``: play policies on the held-out flocks of a task, and play a result again."""

import hashlib
import os
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple, Self

import numpy as np

from flockesc_env.common.checks import FloatArray, as_count, as_seed, as_seeds
from flockesc_env.common.errors import InputError, errors_at, shown
from flockesc_env.models.records import versions
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.registry import load_policy, parse_policy, policy_file, trained
from flockesc_env.policies.rollout import play
from flockesc_env.policies.rules import RandomRange
from flockesc_env.policies.setup import Setup
from flockesc_env.taskset import results
from flockesc_env.taskset.fitting import is_checkable
from flockesc_env.taskset.task import FLOCKS, VERSION, Task, tasks

_SHOWN: Final = 3
"""Flocks that the error about a difference names."""


class LoadedPolicy(NamedTuple):
    """A policy with the text that names it, and the checksum of the bytes that it was loaded from.

    Attributes:
        spec: path of a policy file, of a training run's folder too; name of a policy; or ``module:function``.
        sha256: checksum of the policy file; empty without a file.
        policy: the policy.
    """

    spec: str
    sha256: str
    policy: BasePolicy

    @classmethod
    def of(cls, spec: str, find: Callable[[str], BasePolicy] = load_policy, *, sha256: str = "") -> Self:
        """Return the policy that a text names; ``find`` knows those without a file. A file is read once.

        A file with another checksum than ``sha256``, if that is given, is refused.
        """
        file = None if spec in trained() else policy_file(spec)
        if file is None:
            if results.is_file(spec):
                raise InputError("policy", "an existing policy file", shown(spec))
            return cls(spec, "", find(spec))
        raw = file.read_bytes()
        found = hashlib.sha256(raw).hexdigest()
        if sha256 not in {"", found}:
            expected = f"{spec} with the sha256 {sha256} (restore the file, or score it again)"
            raise InputError("policy", expected, found)
        return cls(str(file), found, parse_policy(raw, file))


def objective_of(entry: Setup, task: Task, scenario: str, flocks: Sequence[int]) -> FloatArray:
    """Play a policy of ``Task.setup`` in a scenario of the task; return the objective, shape (flocks,)."""
    return play(replace(entry, scenario=task.scenarios[scenario]), flocks)[task.spec.name]


def score(
    policies: Sequence[LoadedPolicy],
    task: Task,
    *,
    learner: str,
    output: Path | None = None,
    training: results.Training | None = None,
    report: Callable[[str], None] = lambda _: None,
) -> results.Result:
    """Play the policies of a learner or rule, one per training seed, on the held-out flocks of a task.

    ``output`` is the path of the result, which is not written: the result names files relative to its folder,
    and they must lie in or below it. Without it they are relative to the current folder, wherever they lie.
    ``report`` is called with the name of every policy before it plays.

    Raises:
        InputError: if a policy does not fit the task, two policies reach equal objectives on all flocks, a
            policy file is not in or below the folder of ``output``, or the training does not have one seed
            per policy.
    """
    results.check_training(training, len(policies))
    folder = (Path() if output is None else output.parent).resolve()
    files = {spec: Path(spec).parent.resolve() / Path(spec).name for spec, sha256, _ in policies if sha256}
    fitting = []  # a link to a file stays itself
    for spec, sha256, policy in policies:
        source = Path(os.path.relpath(files[spec], folder)).as_posix() if spec in files else spec
        with errors_at(f"{spec}: "):
            fitting.append((source, task.setup(policy)))
            if output is not None:
                if spec in files and not results.is_below(source):
                    raise InputError("policy", _below(files.values(), output), shown(source))
                results.check_source(source, sha256)
    found: list[results.PolicyResult] = []
    for (spec, sha256, _), (source, entry) in zip(policies, fitting, strict=True):
        report(spec)
        objectives = {name: objective_of(entry, task, name, FLOCKS).tolist() for name in task.scales}
        found.append(results.PolicyResult(policy=source, sha256=sha256, objectives=objectives))
        results.check_different(found, task)
    return results.Result(
        version=VERSION,
        task=task.name,
        task_sha256=task.sha256,
        flocks=(FLOCKS.start, len(FLOCKS)),
        learner=learner,
        is_code=not all(  # others can play a file or a built-in policy that computes rows one by one
            (sha256 or not results.is_code(spec)) and is_checkable(policy)
            for spec, sha256, policy in policies
        ),
        policies=found,
        training=training,
        versions=versions(),
    )


def draw_flocks(count: int, seed: int) -> list[int]:
    """Return the seeds of ``count`` of the held-out flocks, in rising order, all if there are not more.

    Nobody who writes a result may know the seed of the draw before.
    """
    chosen = np.random.default_rng(as_seed(seed, "draw")).permutation(FLOCKS)[: as_count(count, "flocks")]
    return sorted(chosen.tolist())


def verify(path: Path, *, flocks: Sequence[int] | None = None) -> results.Result:
    """Play a result again and compare every objective, bit for bit; return the result.

    Args:
        path: path of the result. Policy files lie relative to it.
        flocks: seeds of the flocks to play, for example those of ``draw_flocks``; None: all.

    Raises:
        InputError: if ``flocks`` is empty or has other seeds than the held-out flocks; if the result is not
            about this version's tasks and flocks, a policy file has another checksum, a policy does not fit
            the task, two policies have equal objectives, an objective differs, or the policies are code.
    """
    result = results.read_result(path)
    task = tasks[result.task]
    seeds = list(FLOCKS) if flocks is None else as_seeds(flocks, "flocks")
    if not set(seeds) <= {*FLOCKS}:
        raise InputError("flocks", f"seeds from {FLOCKS[0]} to {FLOCKS[-1]}", shown(flocks))
    drawn = [seed - FLOCKS.start for seed in seeds]
    found = []
    for index, policy in enumerate(result.policies):
        with errors_at(f"{path}: policies[{index}]: "):
            found.append(task.setup(_find(policy, path.parent)))
    for index, (policy, entry) in enumerate(zip(result.policies, found, strict=True)):
        for name, recorded in policy.objectives.items():
            if isinstance(entry.policy, RandomRange):  # its numbers depend on all flocks before
                played = objective_of(entry, task, name, FLOCKS)[drawn]
            else:
                played = objective_of(entry, task, name, seeds)
            given = np.array(recorded)[drawn]
            differs = np.flatnonzero(played.view(np.int64) != given.view(np.int64))
            if len(differs):
                named = ", ".join(
                    f"flock {seeds[at]}: {float(given[at])!r}, played {float(played[at])!r}"
                    for at in differs[:_SHOWN]
                )
                expected = f"objectives in {name} with the bits that {policy.policy} reaches"
                others = f"{len(differs)} of {len(drawn)} others ({named})"
                raise InputError(f"{path}: policies[{index}]", expected, others)
    return result


def _find(policy: results.PolicyResult, folder: Path) -> BasePolicy:
    """Return a policy of a result in ``folder``, after a check of its file."""
    if results.is_code(policy.policy):
        expected = "a policy file or the name of a policy, which can be played again"
        raise InputError("policy", expected, f"{shown(policy.policy)}, played by its author's code")
    if not results.is_file(policy.policy):
        return load_policy(policy.policy)
    return LoadedPolicy.of(str(folder / policy.policy), sha256=policy.sha256).policy


def _below(files: Collection[Path], output: Path) -> str:
    """Return the expected place of policy files, with the path of a result that they lie below."""
    above = Path(os.path.relpath(os.path.commonpath([file.parent for file in files])), output.name)
    return f"a file in or below the result's folder (copy it there, or give --output {above})"
