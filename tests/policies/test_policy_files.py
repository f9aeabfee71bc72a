"""Policy files load unchanged; other files are refused."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from option_table import small_flock

import flockesc_env as fe
from flockesc_env import policies
from flockesc_env.policies.network import Architecture, NetworkPolicy
from flockesc_env.policies.registry import TRAINED, find_policy, trained
from flockesc_env.taskset import read_result

SCOREBOARD = Path(__file__).parents[2] / "scoreboard"
SCENARIO = small_flock(num_agents=6, predator_range=60.0)
ARCHITECTURE = Architecture(("time", "predator_distance"), (3, 2), memory=1, mirror=True, squash="tanh")
LINE = Architecture(("time", "offset_0"), ())
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


def flock_policy() -> policies.BasePolicy:
    options = {"max_range": 30.0, "predator_sensing_range": math.inf, "steps_per_action": 2}
    policy = NetworkPolicy(ARCHITECTURE, np.random.default_rng(0).normal(size=ARCHITECTURE.size))
    return policy.with_options(name="mine", per_agent=True, scenario=SCENARIO, **options)


def line_policy() -> policies.BasePolicy:
    made_for = fe.LineScenario(num_agents=9)
    return NetworkPolicy(LINE, [1, -2, 0.5]).with_options(name="line", per_agent=False, scenario=made_for)


def rule_policy(rule: Any) -> policies.BasePolicy:
    entries = ("closest_approach", "escape_direction")
    return rule.with_options(name="mine", per_agent=True, scenario=SCENARIO, extra_entries=entries)


@pytest.mark.parametrize(
    "entry",
    [
        flock_policy(),
        line_policy(),
        rule_policy(policies.FixedRange(3.0)),
        rule_policy(policies.StubbornLeaders(-0.5, 30.0)),
        policies.ListenWhileFleeing(-0.5, 30.0).with_options(name="mine", per_agent=False, scenario=SCENARIO),
        rule_policy(policies.BestNextHeading(0.25)).with_options(profile_ranges=(0.0, 10.0)),
        rule_policy(policies.StubbornWitnesses(0.25, 50.0, 12.0, 30.0, 2.0)),
        rule_policy(policies.ListenWhileThreatened(40.0, 20.0, 30.0)),
        rule_policy(policies.WinStayLoseShift(10.0, 30.0, 20.0)),
        rule_policy(policies.WinStayLoseShift(10.0, 30.0, 0.8, 2.0, criterion="escape_direction")),
        rule_policy(policies.WinStayLoseShift(1, 3, 0.8, 2, 0.2, criterion="estimated_escape_direction")),
    ],
    ids=lambda entry: type(entry).__name__,
)
def test_a_policy_loads_unchanged_and_plays_as_before(entry: Any, tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    fe.save_policy(entry, str(path))
    found: Any = fe.load_policy(path)
    assert type(found) is type(entry)
    assert (found.name, found.per_agent, found.scenario) == (entry.name, entry.per_agent, entry.scenario)
    assert found.policy_spec.options == entry.policy_spec.options
    assert found.options.keys() >= (entry.options or {}).keys()
    assert vars(found).get("architecture") == vars(entry).get("architecture")
    assert found.parameters.tobytes() == entry.parameters.tobytes()
    assert [file.name for file in tmp_path.iterdir()] == ["policy.npz"]
    before, after = (fe.rollout(each, seeds=5) for each in (entry, found))
    np.testing.assert_equal(vars(after), vars(before))


@pytest.mark.parametrize("name", [*OTHER_OPTIONS, "per_agent"])
@pytest.mark.parametrize("make", [flock_policy, lambda: rule_policy(policies.StubbornWitnesses())])
def test_a_loaded_policy_refuses_environments_with_other_options(
    make: Callable[[], policies.BasePolicy], name: str, tmp_path: Path
) -> None:
    fe.save_policy(make(), tmp_path / "policy.npz")
    changes: dict[str, Any] = {"max_range": 30.0, "extra_entries": ("escape_direction",)}
    loaded = fe.load_policy(tmp_path / "policy.npz").with_options(**changes)
    own: Any = loaded.options
    makers: dict[bool, Callable[..., Any]] = {True: fe.parallel_env, False: fe.FlockEscapeEnv}
    per_agent = name != "per_agent"
    changed = {name: OTHER_OPTIONS[name]} if per_agent else {}
    env = makers[per_agent](SCENARIO, **{**own, **changed})
    rows = np.zeros((6, len(env.policy_spec.layout.names)), np.float32)
    view: dict[str, Any] = {"per_agent": per_agent, **changed}
    calls: list[Callable[[], Any]] = [
        lambda: loaded.bind(env),
        lambda: loaded.act(rows, env.policy_spec),
        lambda: fe.PredatorEnv(SCENARIO, flock_policy=loaded, **{**own, **view}),
    ]
    if name == "per_agent":
        calls.append(lambda: fe.rollout(SCENARIO, loaded, [0], **view))
    for call in calls:
        with pytest.raises(fe.InputError, check=lambda error: error.field == name) as caught:
            call()
        assert per_agent is ("from the policy" in caught.value.expected)


def test_a_loaded_policy_plays_with_its_own_options(tmp_path: Path) -> None:
    """In any scenario; with others only if ``with_options`` says so, not a caller beside it."""
    fe.save_policy(flock_policy().with_options(min_range=2.0), tmp_path / "policy.npz")
    loaded: Any = fe.load_policy(tmp_path / "policy.npz")
    other = SCENARIO.replace(num_agents=9, num_steps=7)
    expected = fe.rollout(other, loaded, 3)
    env = fe.parallel_env(other, **{**loaded.options, "reward": "distance"})
    act, twin = loaded.bind(env), fe.load_policy(tmp_path)
    observations, infos = env.reset(seed=2)
    while env.agents:
        predicted = twin.predict(np.stack([*observations.values()]))[0]
        actions = act(observations)
        np.testing.assert_array_equal(np.stack([*actions.values()]), predicted)
        observations, *_, infos = env.step(actions)
    assert infos["agent_0"]["min_mean_distance"] == expected.min_mean_distance[2]
    slower = loaded.with_options(steps_per_action=3)
    message = (
        r"expected 2 from the policy, .* got 3 from the caller; .* policy.with_options\(steps_per_action=3"
    )
    for play in (
        fe.rollout,
        lambda scenario, policy, seed, **given: fe.simulate(scenario, policy=policy, **given),
    ):
        with pytest.raises(fe.InputError, match=message):
            play(other, loaded, 3, steps_per_action=3)
    same = fe.rollout(other, loaded, 3, steps_per_action=2, reward="distance")
    np.testing.assert_equal(same.min_mean_distance, expected.min_mean_distance)
    assert fe.rollout(other, slower, 3).min_mean_distance.tolist() != expected.min_mean_distance.tolist()
    with pytest.raises(fe.InputError, match="steps_per_action"):
        slower.bind(env)
    slower.bind(fe.parallel_env(other, **slower.options))
    assert loaded.options["steps_per_action"] == 2


@pytest.mark.parametrize(
    "policy",
    [
        policies.RandomRange(3).with_options(per_agent=True, scenario=SCENARIO),
        NetworkPolicy(LINE, [1, -2, 0.5]),
    ],
)
def test_policies_that_cannot_be_saved_are_refused(policy: policies.BasePolicy, tmp_path: Path) -> None:
    with pytest.raises(fe.InputError, match="policy: expected a NetworkPolicy, FixedRange, "):
        fe.save_policy(policy, tmp_path / "policy.npz")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("make", "changes", "message"),
    [
        (flock_policy, {"architecture": {"inputs": ["time", "wings"]}}, "an entry 'wings'"),
        (line_policy, {"architecture": {"inputs": ["time", "offset_9"]}}, "'offset_9'"),
        (line_policy, {"architecture": {"inputs": [], "candidate_inputs": ["range"]}}, "ranges"),
        (line_policy, {"options": {"action_mode": "range"}}, "action_mode: expected 'normalized'"),
        (flock_policy, {"options": {"max_rang": 3.0}}, "did you mean max_range"),
        (flock_policy, {"model": "fish"}, "model: expected one of flock, line, got 'fish'"),
        (flock_policy, {"architecture": "Rule"}, "architecture: expected one of FixedRange, "),
    ],
)
def test_a_policy_that_cannot_act_is_refused(
    make: Any, changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "policy.npz"
    fe.save_policy(make(), path)
    with np.load(path) as file:
        document, numbers = json.loads(str(file["header"])), file["parameters"]
    if isinstance(network := changes.get("architecture"), dict):
        network |= {"hidden": []}
        numbers = np.zeros(Architecture(**{name: tuple(names) for name, names in network.items()}).size)
    np.savez(path, header=np.array(json.dumps({**document, **changes})), parameters=numbers)
    with pytest.raises(fe.InputError) as caught:
        fe.load_policy(path)
    assert message in str(caught.value)


def test_another_file_is_named(tmp_path: Path) -> None:
    fe.save_policy(flock_policy(), tmp_path / "policy.npz")
    fe.save_run(fe.simulate(SCENARIO, 5.0, seed=0), tmp_path / "run.npz")
    np.savez(tmp_path / "arrays.npz", first=[1], second=[2])
    for call, name, message in (
        (fe.load_policy, "run", "expected a policy, got a recorded run"),
        (fe.load_policy, "arrays", "expected a policy, got the arrays first, second"),
        (fe.load_run, "policy", r"expected a recorded run \(npz\), got a policy"),
    ):
        with pytest.raises(fe.InputError, match=f"{name}.npz: {message}$"):
            call(tmp_path / f"{name}.npz")


def test_policies_are_found_by_name_or_file(tmp_path: Path) -> None:
    path = tmp_path / "policy.npz"
    fe.save_policy(flock_policy(), path)
    assert fe.load_policy(str(path)).name == fe.load_policy(tmp_path).name == "mine"
    for name in policies.NAMES:
        assert fe.load_policy(name.replace("RHO", "3.5")).name == name.replace("RHO", "3.5")
    for spec, near in (("lost.npz", ""), ("fixed:far", ""), ("per-agent-visble/serch", "visible/search")):
        with pytest.raises(fe.InputError, match=r"which: expected fixed:RHO\b.* got '") as caught:
            find_policy(spec, "which")
        assert caught.value.given.startswith(repr(spec))
        assert near in caught.value.given


@pytest.mark.parametrize("name", trained())
def test_trained_policies_are_those_of_the_scoreboard_and_fit_their_tasks(name: str) -> None:
    task, _, learner = name.partition("/")
    (found,) = (policy for policy in [fe.load_policy(name)] if fe.tasks[task].setup(policy))
    assert found.name == name
    result = read_result(SCOREBOARD / learner / f"{task}.json")
    content = (SCOREBOARD / learner / result.policies[0].policy).read_bytes()
    assert (TRAINED / f"{name}.npz").read_bytes() == content
