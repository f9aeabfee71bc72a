"""Networks: the highest score, memory, refusals; rollouts equal ``act``, environments and golden data."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from network_outcomes import SEEDS, cases, hashes, policy_of
from option_table import small_flock

import flockesc_env as fe
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies import Architecture, FixedRange, Policy, bind, torch_network

EPS = float(np.finfo(np.float32).eps)
"""The core computes in float64; actions, at most 1 in magnitude, are rounded to float32."""
FLOCK = small_flock(num_agents=6, num_steps=12, predator_range=60.0)
SCENARIO = fe.LineScenario(num_agents=12, max_steps=40)
LINES = [5, 0, 2**64 - 1, 7, 7, 3]
GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "network_outcomes.json").read_text())


def policy_spec(scenario: fe.FlockScenario = FLOCK, **options: Any) -> PolicySpec:
    return fe.parallel_env(scenario, **options).policy_spec


def test_the_highest_score_sets_the_range() -> None:
    """The scores are linear in the entries; equal scores set the first range."""
    spec = policy_spec(profile_ranges=(0.0, 5.0, 20.0), action_mode="range")  # ranges are exact
    rng, names = np.random.default_rng(0), spec.layout.names
    rows = rng.integers(-2, 3, (40, len(names))).astype(np.float32)
    weights = rng.integers(-2, 3, (2, 3))
    scores = rows[:, [names.index(name) for name in ("time", "speed")]] @ weights
    policy = fe.NetworkPolicy(
        Architecture(("time", "speed"), (), ranges=(3.0, 1.0, 7.0)), [*weights.ravel(), 0, 0, 0]
    )
    ranges = spec.actions.to_ranges(policy.act(rows, spec), 40)
    np.testing.assert_array_equal(ranges, np.array([3.0, 1.0, 7.0])[scores.argmax(axis=1)])
    candidates = ("neighbor_count", "range")
    heard = rows[:, [names.index(f"profile_{k}_neighbor_count") for k in range(3)]]
    scores = rows[:, [names.index("time")]] + heard - 4 * np.array([0, 0.25, 1])
    policy = fe.NetworkPolicy(Architecture(("time",), (), candidate_inputs=candidates), [1, 1, -4, 0])
    ranges = spec.actions.to_ranges(policy.act(rows, spec), 40)
    np.testing.assert_array_equal(ranges, np.array([0.0, 5.0, 20.0])[scores.argmax(axis=1)])


def test_memory_starts_at_zero_and_is_kept() -> None:
    """The action is the memory, and the memory is the time: each action is the tanh of the previous time."""
    spec = policy_spec()
    policy = fe.NetworkPolicy(Architecture(("time",), (), memory=1), [0, 1, 1, 0, 0, 0])

    def actions(*times: float) -> list[float]:
        rows = np.zeros((len(times), len(spec.layout.names)), np.float32)
        rows[:, spec.layout.index("time")] = times
        return policy.act(rows, spec)[:, 0].tolist()

    policy.reset(np.ones(2, bool))
    assert actions(0.0, 0.0) == actions(0.25, 0.5) == [0, 0]
    policy.reset(np.array([False, True]))
    assert actions(0.5, 0.0) == pytest.approx([np.tanh(0.25), 0], abs=EPS)
    assert actions(0.75, 0.1) == pytest.approx([np.tanh(0.5), 0], abs=EPS)
    policy.reset(np.ones(3, bool))
    assert actions(0.0, 0.0, 0.0) == [0, 0, 0]  # other rows
    with pytest.raises(fe.InputError, match="rows: expected 3 rows as before, got 2"):
        policy.reset(np.array([False, True]))


@pytest.mark.parametrize(
    ("fields", "parameters", "message"),
    [
        ({"hidden": (4, 0)}, [0.0], r"hidden\[1\]: expected an integer from 1"),
        ({"memory": 1, "ranges": (1.0, 2.0)}, [0.0], "memory: expected 0 for a network that scores ranges"),
        ({"inputs": ("wings",)}, [0, 0], "observation: expected an entry 'wings', got"),
        ({"mirror": True}, [0, 0], "observation: expected an entry 'predator_direction_left', got"),
        ({"candidate_inputs": ("range",)}, [0, 0, 0], "profile_ranges: expected candidate ranges"),
    ],
)
def test_networks_that_cannot_act_are_refused(fields: dict[str, Any], parameters: Any, message: str) -> None:
    shared = fe.FlockEscapeEnv(FLOCK).policy_spec
    with pytest.raises(fe.InputError, match=message):
        fe.NetworkPolicy(Architecture(**{"inputs": ("time",), "hidden": (), **fields}), parameters).act(
            np.zeros((2, len(shared.layout.names)), np.float32), shared
        )


@pytest.mark.parametrize(
    "names", ["", "Linear ELU Linear", "Linear ReLU Linear Tanh Linear", "Linear Tanh", "Tanh"]
)
def test_other_layers_are_refused(names: str) -> None:
    nn = pytest.importorskip("torch.nn", reason="the extra sb3 is not installed")
    layers = [nn.Linear(2, 2) if name == "Linear" else getattr(nn, name)() for name in names.split()]
    expected = "layers: expected Linear and Tanh, or Linear and ReLU, in turn, Linear first and last"
    with pytest.raises(fe.InputError, match=rf"{expected} .*torch.nn.Tanh"):
        torch_network(layers, ("time",))


class StepByStep:
    """A network that ``rollout`` does not play in the core, because it is not a ``NetworkPolicy``."""

    def __init__(self, policy: fe.NetworkPolicy) -> None:
        self.policy, self.reset, self.act = policy, policy.reset, policy.act


PROFILE = {"profile_ranges": (0.0, 5.0, 20.0), "max_range": 20.0}
HEADS: dict[str, Any] = {
    **cases(),
    "argmax": (
        fe.FlockScenario(num_agents=20, num_steps=40),
        Architecture(("polarization", "mean_distance"), ranges=(0.0, 3.0, 7.3, 20.0)),
        {"max_range": 20.0},
    ),
    "argmax of agents": (
        fe.FlockScenario(num_agents=20, num_steps=40),
        Architecture(("speed", "heard_velocity_left"), mirror=True, ranges=(0.0, 3.0, 20.0)),
        {"max_range": 20.0, "per_agent": True, "action_mode": "discrete"},
    ),
    "candidates": (
        fe.FlockScenario(num_agents=20, num_steps=40),
        Architecture(("time",), candidate_inputs=("range", "neighbor_count"), mirror=True),
        {**PROFILE, "per_agent": True},
    ),
}


def test_python_and_the_networks_above_have_every_field_of_an_architecture() -> None:
    plain = Architecture(("time",))
    policy, spec = fe.NetworkPolicy(plain, np.zeros(plain.size)), fe.FlockEscapeEnv().policy_spec
    policy._document = '{"no_such_field": 0}'
    with pytest.raises(fe.InputError, match="no_such_field") as caught:
        policy.act(np.zeros((1, len(spec.layout.names)), np.float32), spec)
    names = {field.name for field in dataclasses.fields(plain)}
    assert set(re.findall(r"`(\w+)`", caught.value.expected)) == names
    used = {name for _, each, _ in HEADS.values() for name in names if vars(each)[name] != vars(plain)[name]}
    assert used == names


@pytest.mark.parametrize("name", HEADS)
def test_episodes_equal_those_of_act_to_the_bit(name: str) -> None:
    scenario, architecture, options = HEADS[name]
    policy = policy_of(architecture)
    found, expected = (fe.rollout(scenario, each, SEEDS, **options) for each in (policy, StepByStep(policy)))
    for field, values in vars(expected).items():
        tolerance = 1e-12 if field == "mean_return" else 0  # NumPy's mean over agents is not exact
        np.testing.assert_allclose(getattr(found, field), values, rtol=tolerance, atol=0, err_msg=field)


@pytest.mark.parametrize("num_threads", [1, 3])
def test_outcomes_equal_the_golden_data(num_threads: int) -> None:
    assert hashes(num_threads) == GOLDEN


def by_time_and_offsets() -> Policy:
    architecture = Architecture(("time", "escape_distance", "offset_0", "offset_11"), (5,), memory=1)
    return fe.NetworkPolicy(architecture, np.random.default_rng(2).normal(0, 2, architecture.size))


def one_by_one(policy: Policy, scenario: fe.LineScenario, **options: Any) -> dict[str, list[Any]]:
    env = fe.LineEscapeEnv(scenario, **options)
    act, found = bind(policy, env), []
    for seed in LINES:
        observation, info = env.reset(seed=seed)
        terminated = truncated = False
        while not (terminated or truncated):
            observation, _, terminated, truncated, info = env.step(act(observation))
        found.append((info["escape_distance"], info["num_components"], terminated, observation[0]))
    names = ("escape_distance", "num_components", "converged", "time")
    return dict(zip(names, map(list, zip(*found, strict=True)), strict=True))


@pytest.mark.parametrize("make", [by_time_and_offsets, lambda: FixedRange(0.125)])
@pytest.mark.parametrize("steps_per_action", [1, 3])
@pytest.mark.parametrize("batch_size", [1, 4, 6, 100])
def test_it_equals_the_environment_line_by_line(make: Any, steps_per_action: int, batch_size: int) -> None:
    options = {"steps_per_action": steps_per_action, "max_range": 0.5}
    expected = one_by_one(make(), SCENARIO, **options)
    found = fe.rollout(SCENARIO, make(), LINES, batch_size=batch_size, **options)
    assert found.seeds.tolist() == LINES
    assert found.num_components.tolist() == expected["num_components"]
    assert found.converged.tolist() == expected["converged"]
    np.testing.assert_array_equal((found.steps / SCENARIO.max_steps).astype(np.float32), expected["time"])
    # A network's sums may round differently if there are fewer rows.
    np.testing.assert_allclose(found.escape_distance, expected["escape_distance"], rtol=0, atol=1e-6)
    assert len({*found.steps.tolist()}) > 1  # lines end at different times
