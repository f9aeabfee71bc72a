"""Policy files: the parameters of a network or a rule, with the options that it was made for."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from flockesc_env.common.array_files import read_document, write_document
from flockesc_env.common.checks import as_instance, as_path
from flockesc_env.common.errors import ArgumentError, RecordError, ScenarioError
from flockesc_env.episodes.options import EnvOptions, LineOptions
from flockesc_env.models.records import versions
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.policies.registry import NAMES, NamedPolicy, built_in
from flockesc_env.policies.rules import StubbornWitnesses
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario

SUFFIX = ".npz"
_MODELS: dict[str, type[FlockScenario | LineScenario]] = {"flock": FlockScenario, "line": LineScenario}

Stored = NetworkPolicy | StubbornWitnesses
"""Policies that are arrays of parameters, which files can hold."""


def save_policy(policy: NamedPolicy, path: str | Path) -> None:
    """Write a policy and what it was made for to a file; an older file stays whole until this is complete.

    Args:
        policy: a ``NetworkPolicy`` or ``StubbornWitnesses``, with the scenario that it was trained in.
        path: path of the file.

    Raises:
        ArgumentError: if an argument has a wrong type.
        RecordError: if the policy is of another class, or its scenario or an option is unknown.
    """
    file_path = as_path(path)
    as_instance(policy, "policy", NamedPolicy)
    inner, scenario = policy.policy, policy.scenario
    if not isinstance(inner, Stored) or scenario is None:
        expected = "a NetworkPolicy or StubbornWitnesses with its scenario"
        raise RecordError("policy", expected, type(inner).__name__)
    header = {
        "name": policy.name,
        "model": "flock" if isinstance(scenario, FlockScenario) else "line",
        "scenario": json.loads(scenario.to_json()),
        "per_agent": policy.per_agent,
        "options": policy.options,
        "architecture": (
            dataclasses.asdict(inner.architecture) if isinstance(inner, NetworkPolicy) else None
        ),
        "versions": versions(),
    }
    try:
        write_document(file_path, header, {"parameters": inner.parameters})
    except TypeError as error:
        raise RecordError("policy.options", "plain numbers and texts", error) from None


def load_policy(path: str | Path) -> NamedPolicy:
    """Read a policy that ``save_policy`` wrote; nothing in the file is executed.

    Raises:
        ArgumentError: if ``path`` is not a path.
        FileNotFoundError: if there is no such file.
        RecordError: if the file is not a complete policy.
        ScenarioError: if this version does not know the scenario or an option.
    """
    header, arrays = read_document(as_path(path), "a policy")
    try:
        return _named_policy(header, arrays["parameters"])
    except ScenarioError:
        raise
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise RecordError(str(path), "a policy", repr(error)) from None


def find_policy(spec: str, argument: str = "policies") -> NamedPolicy:
    """Return a built-in policy by its name, or the policy in a file.

    Args:
        spec: one of ``flockesc_env.policies.registry.NAMES``, or a path of a ``save_policy`` file.
        argument: name of the argument in an error.

    Raises:
        ArgumentError: if there is neither such a policy nor such a file.
        RecordError: as ``load_policy``.
    """
    if Path(spec).suffix != SUFFIX:
        return built_in(spec, argument)
    if not Path(spec).is_file():
        raise ArgumentError(argument, f"one of {', '.join(NAMES)} or a policy's file", repr(spec))
    return load_policy(spec)


def _named_policy(header: dict[str, Any], parameters: Any) -> NamedPolicy:
    name, per_agent, options = header["name"], header["per_agent"], header["options"]
    if not isinstance(name, str) or not isinstance(per_agent, bool):
        raise RecordError("header", "a text as name, true or false as per_agent", f"{name!r}, {per_agent!r}")
    scenario = _MODELS[header["model"]].from_json(json.dumps(header["scenario"]))
    (EnvOptions if isinstance(scenario, FlockScenario) else LineOptions)(**options)  # refuses unknown options
    policy = _policy(header["architecture"], parameters)
    return NamedPolicy(name, policy, per_agent=per_agent, options=options, scenario=scenario)


def _policy(fields: dict[str, Any] | None, parameters: Any) -> Stored:
    """Return the network of an architecture or, without one, the rule."""
    if fields is None:
        return StubbornWitnesses(*parameters)
    lists = {"inputs": tuple(fields["inputs"]), "hidden": tuple(fields["hidden"])}
    return NetworkPolicy(Architecture(**{**fields, **lists}), parameters)
