"""Lookup of policies: built-in ones, policy files, folders of runs, and ``module:function``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from flockesc_env import ArgumentError, FlockScenario, NamedPolicy
from flockesc_env.cli.policies import MODEL_SUFFIX, policy_of
from flockesc_env.common.files import suffix_of
from flockesc_env.policies import NAMES
from flockesc_env.tasks.task import task_of
from training.record import POLICY_FILE

EXPECTED = f"{', '.join(NAMES)}, a policy file, the folder of a finished run or module:function"


def named_policy(spec: str, task: str | None = None) -> NamedPolicy:
    """Return the policy of a command-line argument.

    Args:
        spec: the name of a built-in policy (``flockesc_env.policies.NAMES``), a file that ``save_policy``
            wrote, the folder of a finished run, ``module:function``, a function that returns a
            ``NamedPolicy``, or a model of stable-baselines3, for example ``PPO:model.zip``.
        task: name of the task in which models of stable-baselines3 were trained.

    Raises:
        ArgumentError: if ``spec`` is none of these, it is a model without a task, or the task is unknown.
        RecordError: if the file is damaged or is not a policy.
    """
    known = None if task is None else task_of(task)
    try:
        return policy_of(policy_argument(spec), task=known)
    except ArgumentError as error:
        if is_model(spec):
            raise
        raise ArgumentError(error.field, f"one of {EXPECTED}", error.given) from None


def is_model(spec: str) -> bool:
    """Return whether a command-line argument is a model of stable-baselines3."""
    return suffix_of(spec) == MODEL_SUFFIX


def policy_argument(spec: str) -> str:
    """Return the policy file of a run's folder, or ``spec`` itself: what ``flockesc`` takes as a policy."""
    file = Path(spec) / POLICY_FILE
    return str(file) if file.is_file() else spec


def scenario_of(entries: Iterable[NamedPolicy]) -> FlockScenario:
    """Return the scenario in which the policies were trained, or the paper's flock if none was trained.

    Raises:
        ArgumentError: if they were trained in different scenarios, or on a line.
    """
    scenarios = {entry.scenario for entry in entries if entry.scenario is not None} or {FlockScenario()}
    if len(scenarios) > 1:
        raise ArgumentError("policies", "policies of one scenario", f"policies of {len(scenarios)} scenarios")
    scenario = scenarios.pop()
    if not isinstance(scenario, FlockScenario):
        raise ArgumentError("policies", "policies of a flock", "policies of a line")
    return scenario
