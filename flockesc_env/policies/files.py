"""Policy files (npz): ``save_policy`` and ``parse_policy``."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from flockesc_env.common.array_files import read_document, write_document
from flockesc_env.common.checks import as_choice, as_path
from flockesc_env.common.errors import InputError, shown
from flockesc_env.episodes.options import UNOBSERVED, to_plain
from flockesc_env.episodes.spaces import PolicySpec, policy_spec
from flockesc_env.models.records import versions
from flockesc_env.policies.base import BasePolicy
from flockesc_env.policies.memory_rules import ListenWhileThreatened, StubbornWitnesses, WinStayLoseShift
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.scenario.document import from_fields
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import MODELS

SUFFIX = ".npz"
POLICY_FILE = "policy.npz"
"""Name of the policy file in the folder of a training run."""

_SHORT_LINE = 1000
_SENSING = "predator_sensing_range"  # infinity is null in the file
_HEADER = {"name", "model", "scenario", "per_agent", "options", "architecture"}

Rule = StubbornWitnesses | ListenWhileThreatened | WinStayLoseShift
Stored = NetworkPolicy | Rule
"""Policies that can be saved: their parameters are an array."""

_RULES: dict[str, type[Rule]] = {rule.__name__: rule for rule in get_args(Rule)}


def save_policy(policy: BasePolicy, path: str | Path) -> None:
    """Write a policy with its scenario and options to an npz file; an existing file is replaced atomically.

    Args:
        policy: a ``NetworkPolicy``, ``StubbornWitnesses``, ``ListenWhileThreatened`` or
            ``WinStayLoseShift``, whose method ``with_options`` gave it a view, a scenario and options.
        path: path of the file.

    Raises:
        InputError: if an argument has the wrong type, the policy is of another class or has no view or
            scenario, or an option is not plain data.
    """
    file_path = as_path(path)
    scenario, per_agent = getattr(policy, "scenario", None), getattr(policy, "per_agent", None)
    if not isinstance(policy, Stored) or scenario is None or per_agent is None:
        kinds = f"a NetworkPolicy, {', '.join(_RULES)}"
        ways = "policy.with_options(per_agent=.., scenario=.., **options) adds them"
        raise InputError("policy", f"{kinds} with its view and scenario ({ways})", shown(policy))
    given, options = policy.options or {}, asdict(policy.policy_spec.options)
    kept = {name: options[name] for name in options if name in given or name not in UNOBSERVED}
    header = {
        "name": policy.name,
        "model": "line" if isinstance(scenario, LineScenario) else "flock",
        "scenario": json.loads(scenario.to_json()),
        "per_agent": per_agent,
        "options": to_plain(kept),
        "architecture": (
            asdict(policy.architecture) if isinstance(policy, NetworkPolicy) else type(policy).__name__
        ),
        **({"criterion": policy.criterion} if isinstance(policy, WinStayLoseShift) else {}),
        "versions": versions(),
    }
    write_document(file_path, header, {"parameters": policy.parameters})


def parse_policy(raw: bytes, path: Path) -> BasePolicy:
    """Return the policy in the bytes of a policy file; see ``load_policy``. Errors name ``path``."""
    header, arrays = read_document(path, "a policy", "parameters", raw)
    try:
        return _stored_policy(header, arrays["parameters"])
    except InputError as error:
        raise InputError(f"{path}: {error.field}", error.expected, error.given) from None
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(str(path), "a policy", repr(error)) from None


def _stored_policy(header: dict[str, Any], parameters: Any) -> BasePolicy:
    if not header.keys() >= _HEADER:
        raise InputError("header", ", ".join(sorted(_HEADER)), ", ".join(header) or "none")
    name, per_agent, options = header["name"], header["per_agent"], dict(header["options"])
    if options.get(_SENSING, 0.0) is None:
        options[_SENSING] = math.inf
    if not isinstance(name, str) or not isinstance(per_agent, bool):
        raise InputError("header", "a string name, a bool per_agent", f"{name!r}, {per_agent!r}")
    scenario = from_fields(MODELS[as_choice(header["model"], "model", MODELS)], header["scenario"])
    short = scenario
    if isinstance(scenario, LineScenario):  # a long one has gigabytes of entries, of the same kinds
        short = scenario.replace(num_agents=min(scenario.num_agents, _SHORT_LINE))
    spec = policy_spec(short, options, per_agent=per_agent)
    chosen = {"criterion": header["criterion"]} if "criterion" in header else {}
    architecture: dict[str, Any] | str = header["architecture"]
    policy: Stored
    if isinstance(architecture, str):
        policy = _RULES[as_choice(architecture, "architecture", _RULES)](*parameters, **chosen)
    else:
        lists = {name: tuple(value) for name, value in architecture.items() if isinstance(value, list)}
        policy = NetworkPolicy(Architecture(**{**architecture, **lists}), parameters)
        _check_action(policy, spec, scenario.num_agents)
    return policy.with_options(name=name, per_agent=per_agent, scenario=scenario, **options)


def _check_action(policy: NetworkPolicy, spec: PolicySpec, num_agents: int) -> None:
    """Check that a network can act, for example that its inputs are observed."""
    known = set(spec.layout.names)

    def shortened(name: str) -> str:
        rank = name.removeprefix("offset_")
        is_far = "offset_0" in known and rank.isdecimal() and _SHORT_LINE <= int(rank) < num_agents
        return "offset_0" if is_far and name == f"offset_{int(rank)}" else name

    inputs = tuple(map(shortened, policy.architecture.inputs))
    architecture = replace(policy.architecture, inputs=inputs)
    NetworkPolicy(architecture, policy.parameters).act(np.zeros((1, len(known)), np.float32), spec)
