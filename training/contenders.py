"""What can be compared: built-in policies by name, files, folders of runs, one's own code."""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from pathlib import Path

from flockesc_env import FlockScenario
from flockesc_env.common.errors import ArgumentError
from flockesc_env.policies.files import find_policy
from flockesc_env.policies.registry import NAMES, NamedPolicy
from training.config import POLICY_FILE

EXPECTED = f"{', '.join(NAMES)}, a policy's file, the folder of a finished run or module:function"


def contender(spec: str) -> NamedPolicy:
    """Make a contender of its name.

    Args:
        spec: a built-in policy (``flockesc_env.policies.registry.NAMES``), a file that ``save_policy`` wrote,
            the folder of a finished run, or ``module:function``, a function that returns a ``NamedPolicy``.

    Raises:
        ArgumentError: if there is nothing of that name.
        RecordError: if the file is no policy.
    """
    file = Path(spec) / POLICY_FILE
    if file.is_file():
        return find_policy(str(file))
    module, is_code, function = spec.partition(":")
    if is_code and module != "fixed":
        return _own(module, function, spec)
    try:
        return find_policy(spec)
    except ArgumentError as error:
        raise ArgumentError(error.field, f"one of {EXPECTED}", error.given) from None


def scenario_of(entries: Iterable[NamedPolicy]) -> FlockScenario:
    """Return the flock that contenders were trained in; the paper's where none was.

    Raises:
        ArgumentError: if they were trained in several, or in a line.
    """
    scenarios = {entry.scenario for entry in entries if entry.scenario is not None} or {FlockScenario()}
    if len(scenarios) > 1:
        raise ArgumentError("policies", "policies of one scenario", f"of {len(scenarios)}")
    scenario = scenarios.pop()
    if not isinstance(scenario, FlockScenario):
        raise ArgumentError("policies", "policies of a flock", "of a line")
    return scenario


def _own(module: str, function: str, spec: str) -> NamedPolicy:
    try:
        made = getattr(importlib.import_module(module), function)()
    except (ImportError, AttributeError) as error:
        raise ArgumentError("policies", f"one of {EXPECTED}", f"{spec!r} ({error})") from None
    if not isinstance(made, NamedPolicy):
        raise ArgumentError("policies", f"a NamedPolicy from {spec}", type(made).__name__)
    return made
