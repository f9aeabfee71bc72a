"""Policy files load unchanged; other files are refused."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from option_table import small_flock

import flockesc_env as fe
from flockesc_env.common.errors import InputError
from flockesc_env.policies import FixedRange, ListenWhileThreatened, StubbornWitnesses, WinStayLoseShift
from flockesc_env.policies.files import find_policy
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.policies.registry import NamedPolicy, built_in

SCENARIO = small_flock(num_agents=6, predator_range=60.0)
ARCHITECTURE = Architecture(("time", "predator_distance"), (3, 2), memory=1, mirror=True, squash="tanh")
LINE = Architecture(("time", "offset_0"), ())


def flock_policy() -> NamedPolicy:
    options = {"max_range": 30.0, "predator_sensing_range": math.inf, "steps_per_action": 2}
    numbers = np.random.default_rng(0).normal(size=ARCHITECTURE.size)
    policy = NetworkPolicy(ARCHITECTURE, numbers)
    return NamedPolicy("mine", policy, per_agent=True, options=options, scenario=SCENARIO)


def line_policy() -> NamedPolicy:
    return NamedPolicy("line", NetworkPolicy(LINE, [1, -2, 0.5]), scenario=fe.LineScenario(num_agents=9))


def rule_policy(rule: Any) -> NamedPolicy:
    options = {"extra_entries": ("closest_approach", "escape_direction")}
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
    ],
    ids=lambda entry: type(entry.policy).__name__,
)
def test_a_policy_loads_unchanged_and_plays_as_before(entry: Any, tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    fe.save_policy(entry, str(path))
    found: Any = fe.load_policy(path)
    assert type(found.policy) is type(entry.policy)
    options = json.loads(json.dumps(entry.options))
    assert dataclasses.replace(found, policy=entry.policy) == dataclasses.replace(entry, options=options)
    assert vars(found.policy).get("architecture") == vars(entry.policy).get("architecture")
    assert found.policy.parameters.tobytes() == entry.policy.parameters.tobytes()
    assert [file.name for file in tmp_path.iterdir()] == ["policy.npz"]
    before, after = (fe.rollout(None, each, range(5)) for each in (entry, found))
    np.testing.assert_equal(vars(after), vars(before))
    with pytest.raises(FileNotFoundError):
        fe.load_policy(tmp_path / "lost.npz")


OTHER_OPTIONS: dict[str, Any] = {
    "action_mode": "range",
    "min_range": 1.0,
    "max_range": 31.0,
    "range_grid": (0.0, 10.0),
    "steps_per_action": 3,
    "objective": "min_min_distance",
    "predator_sensing_range": 12.0,
    "profile_ranges": (0.0, 10.0),
    "extra_entries": (),
}
"""Other values of all options that change what a policy observes or what its actions mean."""


@pytest.mark.parametrize("name", [*OTHER_OPTIONS, "per_agent"])
@pytest.mark.parametrize("make", [flock_policy, lambda: rule_policy(StubbornWitnesses())])
def test_a_loaded_policy_refuses_environments_with_other_options(
    make: Callable[[], NamedPolicy], name: str, tmp_path: Path
) -> None:
    fe.save_policy(make(), tmp_path / "policy.npz")
    stored = fe.load_policy(tmp_path / "policy.npz")
    own = {**stored.options, "max_range": 30.0, "extra_entries": ("escape_direction",)}
    loaded = dataclasses.replace(stored, options=own)
    makers: dict[bool, Callable[..., Any]] = {True: fe.parallel_env, False: fe.FlockEscapeEnv}
    per_agent = name != "per_agent"
    changed = {name: OTHER_OPTIONS[name]} if per_agent else {}
    env = makers[per_agent](SCENARIO, **{**own, **changed})
    rows = np.zeros((6, len(env.policy_spec.layout.names)), np.float32)
    view: dict[str, Any] = {"per_agent": per_agent, **changed}
    calls: list[Callable[[], Any]] = [
        lambda: fe.bind(loaded.policy, env),
        lambda: loaded.policy.act(rows, env.policy_spec),
        lambda: fe.rollout(SCENARIO, loaded.policy, [0], **view),
        lambda: fe.record(SCENARIO, loaded.policy, 0, **view),
        lambda: fe.PredatorEnv(SCENARIO, flock_policy=loaded.policy, **{**own, **view}),
    ]
    for call in calls:
        with pytest.raises(InputError) as caught:
            call()
        assert caught.value.field == name
        assert per_agent is ("(use **load_policy(path).options)" in caught.value.expected)


def test_a_loaded_policy_plays_with_its_own_options(tmp_path: Path) -> None:
    """In any scenario; with others only if a ``NamedPolicy`` or the options of its rollout say so."""
    fe.save_policy(flock_policy(), tmp_path / "policy.npz")
    loaded = fe.load_policy(tmp_path / "policy.npz")
    other = SCENARIO.replace(num_agents=9, num_steps=7)
    expected = fe.rollout(other, loaded, range(3))
    np.testing.assert_equal(vars(fe.rollout(other, loaded.policy, range(3))), vars(expected))
    env = fe.parallel_env(other, **loaded.options, reward="distance")
    act = fe.bind(loaded.policy, env)
    observations, infos = env.reset(seed=2)
    while env.agents:
        observations, *_, infos = env.step(act(observations))
    assert infos["agent_0"]["min_mean_distance"] == expected.min_mean_distance[2]
    options = {**loaded.options, "steps_per_action": 3}
    slower = dataclasses.replace(loaded, options=options)
    given = fe.rollout(other, loaded, range(3), steps_per_action=3)
    np.testing.assert_equal(vars(fe.rollout(other, slower, range(3))), vars(given))
    fe.bind(slower.policy, fe.parallel_env(other, **options))
    with pytest.raises(InputError, match="steps_per_action: expected 2"):
        fe.rollout(other, loaded.policy, range(3), steps_per_action=3)


@pytest.mark.parametrize("changes", [{"policy": FixedRange(3)}, {"scenario": None}])
def test_policies_that_cannot_be_saved_are_refused(changes: dict[str, Any], tmp_path: Path) -> None:
    entry = dataclasses.replace(flock_policy(), **changes)
    with pytest.raises(InputError, match="policy: expected a NetworkPolicy, StubbornWitnesses, "):
        fe.save_policy(entry, tmp_path / "policy.npz")
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
    fe.save_policy(make(), tmp_path / "policy.npz")
    if network := changes.get("architecture"):
        size = Architecture(**{name: tuple(entries) for name, entries in network.items()}).size
        changes = {**changes, "parameters": np.zeros(size)}
    with pytest.raises(InputError) as caught:
        fe.load_policy(rewritten(tmp_path / "policy.npz", **changes))
    assert message in str(caught.value)


def test_another_file_is_named(tmp_path: Path) -> None:
    fe.save_policy(flock_policy(), tmp_path / "policy.npz")
    fe.save_run(fe.simulate(SCENARIO, 5.0, seed=0), tmp_path / "run.npz")
    np.savez(tmp_path / "start.npz", positions=np.zeros((3, 2)))
    np.savez(tmp_path / "arrays.npz", first=[1], second=[2])
    for call, name, message in (
        (fe.load_policy, "run", "expected a policy, got a recorded run"),
        (fe.load_policy, "start", "expected a policy, got an initial state"),
        (fe.load_policy, "arrays", "expected a policy, got the arrays first, second"),
        (fe.load_run, "policy", r"expected a recorded run \(npz\), got a policy"),
    ):
        with pytest.raises(InputError, match=f"{name}.npz: {message}$"):
            call(tmp_path / f"{name}.npz")
    for changes, message in (
        ({"model": "fish"}, "model: expected one of flock, line, got 'fish'"),
        ({"architecture": "Rule"}, "architecture: expected one of StubbornWitnesses, .*, got 'Rule'"),
        ({"options": {"max_rang": 3.0}}, "max_rang: .*did you mean max_range"),
    ):
        fe.save_policy(flock_policy(), tmp_path / "policy.npz")
        with pytest.raises(InputError, match=message):
            fe.load_policy(rewritten(tmp_path / "policy.npz", **changes))


def test_policies_are_found_by_name_or_file(tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    fe.save_policy(flock_policy(), path)
    assert find_policy(str(path)).name == "mine"
    for name in ("random", "stubborn-leaders", "fixed:3.5"):
        found, expected = find_policy(name), built_in(name)
        assert type(found.policy) is type(expected.policy)
        assert (found.name, found.per_agent, found.options) == (name, expected.per_agent, expected.options)
    for spec in ("lost.npz", str(tmp_path), "fixed:far", "policy"):
        with pytest.raises(InputError, match=r"which: expected one of fixed:RHO, .* got '") as caught:
            find_policy(spec, "which")
        assert caught.value.given.startswith(repr(spec))
