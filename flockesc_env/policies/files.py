"""Policy files (npz): ``save_policy``, ``load_policy`` and ``find_policy``."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any, get_args

import numpy as np

from flockesc_env.common.array_files import read_document, write_document
from flockesc_env.common.checks import as_choice, as_instance, as_path
from flockesc_env.common.errors import InputError
from flockesc_env.common.files import suffix_of
from flockesc_env.episodes.options import View, env_options, line_options
from flockesc_env.episodes.spaces import PolicySpec, flock_policy_spec, line_policy_spec
from flockesc_env.models.records import versions
from flockesc_env.policies.memory_rules import ListenWhileThreatened, StubbornWitnesses, WinStayLoseShift
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.policies.registry import NAMES, NamedPolicy, built_in
from flockesc_env.scenario.document import from_fields
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import MODELS

SUFFIX = ".npz"
_SHORT_LINE = 1000
_SENSING = "predator_sensing_range"  # infinity is null in the file
_HEADER = {"name", "model", "scenario", "per_agent", "options", "architecture"}

Rule = StubbornWitnesses | ListenWhileThreatened | WinStayLoseShift
Stored = NetworkPolicy | Rule
"""Policies that can be saved: their parameters are an array."""

_RULES: dict[str, type[Rule]] = {rule.__name__: rule for rule in get_args(Rule)}


def save_policy(policy: NamedPolicy, path: str | Path) -> None:
    """Write a policy with its scenario and options to an npz file; an existing file is replaced atomically.

    Args:
        policy: a ``NetworkPolicy``, ``StubbornWitnesses``, ``ListenWhileThreatened`` or
            ``WinStayLoseShift`` with the scenario in which it was trained.
        path: path of the file.

    Raises:
        InputError: if an argument has the wrong type; if the policy is of another class, has no scenario, or
            an option is not plain data.
    """
    file_path = as_path(path)
    as_instance(policy, "policy", NamedPolicy)
    inner, scenario = policy.policy, policy.scenario
    if not isinstance(inner, Stored) or scenario is None:
        expected = f"a NetworkPolicy, {', '.join(_RULES)} with its scenario"
        raise InputError("policy", expected, type(inner).__name__)
    header = {
        "name": policy.name,
        "model": "flock" if isinstance(scenario, FlockScenario) else "line",
        "scenario": json.loads(scenario.to_json()),
        "per_agent": policy.per_agent,
        "options": {name: None if value == math.inf else value for name, value in policy.options.items()},
        "architecture": (
            dataclasses.asdict(inner.architecture)
            if isinstance(inner, NetworkPolicy)
            else type(inner).__name__
        ),
        **({"criterion": inner.criterion} if isinstance(inner, WinStayLoseShift) else {}),
        "versions": versions(),
    }
    try:
        write_document(file_path, header, {"parameters": inner.parameters})
    except TypeError as error:
        raise InputError("policy.options", "plain numbers and strings", error) from None


def load_policy(path: str | Path) -> NamedPolicy:
    """Read a policy that ``save_policy`` wrote. Untrusted files are safe: no code in them is executed.

    Raises:
        InputError: if ``path`` is not a path; if the file is damaged, is not a policy, contains an unknown
            option, or its network cannot act in its scenario with its options, for example because it reads
            an unknown input; if the scenario is invalid in this version of the package.
        FileNotFoundError: if the file does not exist.
    """
    file = as_path(path)
    return parse_policy(file.read_bytes(), file)


def parse_policy(raw: bytes, path: Path) -> NamedPolicy:
    """Return the policy in the bytes of a policy file, as ``load_policy``; ``path`` is its name in errors."""
    header, arrays = read_document(path, "a policy", "parameters", raw)
    try:
        return _named_policy(header, arrays["parameters"])
    except InputError as error:
        raise InputError(f"{path}: {error.field}", error.expected, error.given) from None
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(str(path), "a policy", repr(error)) from None


def find_policy(spec: str, argument: str = "policies") -> NamedPolicy:
    """Return a built-in policy, or the policy in a file.

    Args:
        spec: the name of a built-in policy (``flockesc_env.policies.NAMES``), or the path of a file that
            ``save_policy`` wrote.
        argument: name of the argument, for the error message.

    Raises:
        InputError: if ``spec`` is neither a built-in policy nor a file; if the file is damaged or is not a
            policy.
    """
    if suffix_of(spec) != SUFFIX:
        return built_in(spec, argument)
    if not Path(spec).is_file():
        raise InputError(argument, f"one of {', '.join(NAMES)} or an existing policy file", repr(spec))
    return load_policy(spec)


def _named_policy(header: dict[str, Any], parameters: Any) -> NamedPolicy:
    if not header.keys() >= _HEADER:
        raise InputError("header", ", ".join(sorted(_HEADER)), ", ".join(header) or "none")
    name, per_agent, options = header["name"], header["per_agent"], dict(header["options"])
    if options.get(_SENSING, 0.0) is None:
        options[_SENSING] = math.inf
    if not isinstance(name, str) or not isinstance(per_agent, bool):
        raise InputError("header", "a string name, a bool per_agent", f"{name!r}, {per_agent!r}")
    scenario = from_fields(MODELS[as_choice(header["model"], "model", MODELS)], header["scenario"])
    if isinstance(scenario, FlockScenario):
        spec = flock_policy_spec(scenario, env_options(scenario, options), View.of(per_agent))
    else:  # a long line has gigabytes of entries, of the same kinds as a short one
        short = scenario.replace(num_agents=min(scenario.num_agents, _SHORT_LINE))
        spec = line_policy_spec(short, line_options(options))
    chosen = {"criterion": header["criterion"]} if "criterion" in header else {}
    policy = _policy(header["architecture"], parameters, chosen)
    if isinstance(policy, NetworkPolicy):
        _check_action(policy, spec, scenario.num_agents)
    policy = policy.with_options(spec.options, per_agent=per_agent)
    return NamedPolicy(name, policy, per_agent=per_agent, options=options, scenario=scenario)


def _check_action(policy: NetworkPolicy, spec: PolicySpec, num_agents: int) -> None:
    """Check that a network can act, for example that its inputs are observed."""
    known = set(spec.layout.names)

    def shortened(name: str) -> str:
        rank = name.removeprefix("offset_")
        is_far = "offset_0" in known and rank.isdecimal() and _SHORT_LINE <= int(rank) < num_agents
        return "offset_0" if is_far and name == f"offset_{int(rank)}" else name

    inputs = tuple(map(shortened, policy.architecture.inputs))
    architecture = dataclasses.replace(policy.architecture, inputs=inputs)
    NetworkPolicy(architecture, policy.parameters).act(np.zeros((1, len(known)), np.float32), spec)


def _policy(architecture: dict[str, Any] | str, parameters: Any, chosen: dict[str, Any]) -> Stored:
    """Return a network with an architecture, or a rule by its name with its other arguments."""
    if isinstance(architecture, str):
        return _RULES[as_choice(architecture, "architecture", _RULES)](*parameters, **chosen)
    lists = {name: tuple(value) for name, value in architecture.items() if isinstance(value, list)}
    return NetworkPolicy(Architecture(**{**architecture, **lists}), parameters)
