"""Policy files load unchanged; other files are refused."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from option_table import small_flock

from flockesc_env import LineScenario, load_policy, rollout, save_policy
from flockesc_env.common.errors import ArgumentError, RecordError
from flockesc_env.policies import (
    FixedRange,
    ListenWhileThreatened,
    SpreadOut,
    StepAside,
    StubbornWitnesses,
    WinStayLoseShift,
)
from flockesc_env.policies.files import find_policy
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.policies.registry import NamedPolicy, built_in

SCENARIO = small_flock(num_agents=6, predator_range=60.0)
ARCHITECTURE = Architecture(("time", "predator_distance"), (3, 2), memory=1, mirror=True, squash="tanh")
LINE = Architecture(("time", "offset_0"), ())


def flock_policy() -> NamedPolicy:
    options = {"max_range": 30.0, "predator_sensing_range": None, "steps_per_action": 2}
    numbers = np.random.default_rng(0).normal(size=ARCHITECTURE.size)
    policy = NetworkPolicy(ARCHITECTURE, numbers)
    return NamedPolicy("mine", policy, per_agent=True, options=options, scenario=SCENARIO)


def line_policy() -> NamedPolicy:
    return NamedPolicy("line", NetworkPolicy(LINE, [1, -2, 0.5]), scenario=LineScenario(num_agents=9))


def rule_policy(rule: Any) -> NamedPolicy:
    extra = ("closest_approach", "escape_direction")
    options = {"extra_entries": extra, "profile_ranges": (0.0, 10.0, 30.0)}
    return NamedPolicy("mine", rule, per_agent=True, options=options, scenario=SCENARIO)


@pytest.mark.parametrize(
    "entry",
    [
        flock_policy(),
        line_policy(),
        rule_policy(StubbornWitnesses(0.25, 50.0, 12.0, 30.0, 2.0)),
        rule_policy(ListenWhileThreatened(40.0, 20.0, 30.0)),
        rule_policy(WinStayLoseShift(10.0, 30.0, 20.0)),
        rule_policy(WinStayLoseShift(10.0, 30.0, 0.8, 2.0, criterion="escape_direction")),
        rule_policy(SpreadOut(0.5, 0.2, 20.0)),
        rule_policy(StepAside(0.5, 0.1)),
    ],
    ids=lambda entry: type(entry.policy).__name__,
)
def test_a_policy_loads_unchanged_and_plays_as_before(entry: Any, tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    save_policy(entry, str(path))
    found: Any = load_policy(path)
    assert type(found.policy) is type(entry.policy)
    options = json.loads(json.dumps(entry.options))
    assert dataclasses.replace(found, policy=entry.policy) == dataclasses.replace(entry, options=options)
    assert vars(found.policy).get("architecture") == vars(entry.policy).get("architecture")
    assert found.policy.parameters.tobytes() == entry.policy.parameters.tobytes()
    assert [file.name for file in tmp_path.iterdir()] == ["policy.npz"]
    before, after = (rollout(None, each, range(5)) for each in (entry, found))
    np.testing.assert_equal(vars(after), vars(before))
    with pytest.raises(FileNotFoundError):
        load_policy(tmp_path / "lost.npz")


@pytest.mark.parametrize(
    "changes",
    [
        {"policy": FixedRange(3)},
        {"scenario": None},
    ],
)
def test_policies_that_cannot_be_saved_are_refused(changes: dict[str, Any], tmp_path: Path) -> None:
    entry = dataclasses.replace(flock_policy(), **changes)
    with pytest.raises(RecordError, match="policy: expected a NetworkPolicy, StubbornWitnesses, "):
        save_policy(entry, tmp_path / "policy.npz")
    assert not list(tmp_path.iterdir())


def rewritten(path: Path, parameters: Any = None, **header: Any) -> Path:
    """Change entries of a policy file."""
    with np.load(path) as file:
        document, numbers = json.loads(str(file["header"])), file["parameters"]
    numbers = numbers if parameters is None else parameters
    np.savez(path, header=np.array(json.dumps({**document, **header})), parameters=numbers)
    return path


@pytest.mark.parametrize(
    ("make", "changes", "message"),
    [
        (flock_policy, {"architecture": {"inputs": ["time", "wings"], "hidden": [2]}}, "an entry 'wings'"),
        (line_policy, {"architecture": {"inputs": ["time", "offset_9"], "hidden": []}}, "'offset_9'"),
        (
            line_policy,
            {"architecture": {"inputs": [], "hidden": [], "candidate_inputs": ["range"]}},
            "ranges",
        ),
        (line_policy, {"options": {"action_mode": "range"}}, "action_mode: expected 'normalized'"),
    ],
)
def test_a_network_that_cannot_act_is_refused(
    make: Any, changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    save_policy(make(), tmp_path / "policy.npz")
    network = changes.get("architecture")
    if network:
        size = Architecture(
            **{name: tuple(v) if isinstance(v, list) else v for name, v in network.items()}
        ).size
        changes = {**changes, "parameters": np.zeros(size)}
    with pytest.raises(RecordError) as caught:
        load_policy(rewritten(tmp_path / "policy.npz", **changes))
    assert message in str(caught.value)


def test_policies_are_found_by_name_or_file(tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    save_policy(flock_policy(), path)
    assert find_policy(str(path)).name == "mine"
    for name in ("random", "stubborn-leaders", "fixed:3.5"):
        found, expected = find_policy(name), built_in(name)
        assert type(found.policy) is type(expected.policy)
        assert (found.name, found.per_agent, found.options) == (name, expected.per_agent, expected.options)
    for spec in ("lost.npz", str(tmp_path), "fixed:far", "policy"):
        with pytest.raises(ArgumentError, match=r"which: expected one of fixed:RHO, .* got '") as caught:
            find_policy(spec, "which")
        assert caught.value.given.startswith(repr(spec))
