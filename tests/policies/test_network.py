"""Networks as policies against loops over rows, agents and layers, and against networks of torch."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from option_table import small_flock
from torch import nn

import flockesc_env as fe
from flockesc_env.common.errors import InputError
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies import torch_network
from flockesc_env.policies.network import Architecture, NetworkPolicy

EPS = float(np.finfo(np.float32).eps)
"""The core computes in float64; actions, at most 1 in magnitude, are rounded to float32."""
INPUTS = ("predator_distance", "heard_velocity_left", "time", "predator_direction_left")
SCENARIO = small_flock(num_agents=6, num_steps=12, predator_range=60.0)

architectures = st.builds(
    Architecture,
    inputs=st.permutations(INPUTS).map(lambda names: tuple(names[:3])),
    hidden=st.lists(st.integers(1, 5), max_size=3).map(tuple),
    memory=st.integers(0, 3),
    mirror=st.booleans(),
    squash=st.sampled_from(["clip", "tanh"]),
)


def policy_spec(scenario: fe.FlockScenario = SCENARIO, **options: Any) -> PolicySpec:
    return fe.parallel_env(scenario, **options).policy_spec


def parameters(architecture: Architecture, seed: int = 0, networks: tuple[int, ...] = ()) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 1.5, (*networks, architecture.size))


def some_rows(count: int, time: float, rng: np.random.Generator) -> np.ndarray:
    """Return observations; a third of the rows senses no predator."""
    layout = policy_spec().layout
    rows = rng.uniform(layout.low, layout.high, (count, len(layout.names))).astype(np.float32)
    rows[:, layout.index("time")] = time
    for name in layout.names:
        if name.startswith("predator"):
            rows[::3, layout.index(name)] = 0
    return rows


def reference(
    architecture: Architecture, numbers: np.ndarray, row: np.ndarray, memory: list[float]
) -> tuple[float, list[float]]:
    """Run one network on one row with scalar loops; return action and memory."""
    layout = policy_spec().layout
    seen = {name: float(row[layout.index(name)]) for name in layout.names}
    side = seen["predator_direction_left"] or seen["heard_velocity_left"]
    if architecture.mirror and side < 0:
        seen = {name: -value if name.endswith("_left") else value for name, value in seen.items()}
    values, rest = [seen[name] for name in architecture.inputs] + memory, list(numbers)
    widths = [*architecture.hidden, 1 + architecture.memory]
    for layer, width in enumerate(widths):
        weights = [[rest.pop(0) for _ in range(width)] for _ in values]
        biases = [rest.pop(0) for _ in range(width)]
        sums = [
            bias + sum(value * line[column] for value, line in zip(values, weights, strict=True))
            for column, bias in enumerate(biases)
        ]
        values = sums if layer == len(widths) - 1 else [float(np.tanh(one)) for one in sums]
    assert not rest
    action = np.tanh(values[0]) if architecture.squash == "tanh" else min(max(values[0], -1), 1)
    return float(action), [float(np.tanh(value)) for value in values[1:]]


@settings(max_examples=40)
@given(architectures, st.integers(0, 2**32 - 1))
def test_it_equals_the_loop_over_rows_and_layers(architecture: Architecture, seed: int) -> None:
    rng = np.random.default_rng(seed)
    policy = NetworkPolicy(architecture, parameters(architecture, seed))
    numbers = policy.parameters.astype(np.float64)
    memory = [[0.0] * architecture.memory for _ in range(7)]
    for time in (0.0, 0.25, 0.5):
        rows = some_rows(7, time, rng)
        expected = []
        for k, row in enumerate(rows):
            action, memory[k] = reference(architecture, numbers, row, memory[k])
            expected.append([action])
        given_rows = rows.copy()
        actions = policy.act(rows, policy_spec())
        np.testing.assert_allclose(actions, expected, rtol=0, atol=EPS)
        assert actions.shape == (7, 1)
        assert np.abs(actions).max() <= 1
        np.testing.assert_array_equal(rows, given_rows)


def test_the_highest_score_sets_the_range() -> None:
    """The scores are linear in the entries; equal scores set the first range."""
    spec = policy_spec(profile_ranges=(0.0, 5.0, 20.0), action_mode="range")  # ranges are exact
    rng, names = np.random.default_rng(0), spec.layout.names
    rows = rng.integers(-2, 3, (40, len(names))).astype(np.float32)
    weights = rng.integers(-2, 3, (2, 3))
    scores = rows[:, [names.index(name) for name in ("time", "speed")]] @ weights
    policy = NetworkPolicy(
        Architecture(("time", "speed"), (), ranges=(3.0, 1.0, 7.0)), [*weights.ravel(), 0, 0, 0]
    )
    ranges = spec.actions.to_ranges(policy.act(rows, spec), 40)
    np.testing.assert_array_equal(ranges, np.array([3.0, 1.0, 7.0])[scores.argmax(axis=1)])
    candidates = ("neighbor_count", "range")
    heard = rows[:, [names.index(f"profile_{k}_neighbor_count") for k in range(3)]]
    scores = rows[:, [names.index("time")]] + heard - 4 * np.array([0, 0.25, 1])
    policy = NetworkPolicy(Architecture(("time",), (), candidate_inputs=candidates), [1, 1, -4, 0])
    ranges = spec.actions.to_ranges(policy.act(rows, spec), 40)
    np.testing.assert_array_equal(ranges, np.array([0.0, 5.0, 20.0])[scores.argmax(axis=1)])


def test_memory_starts_at_zero_and_is_kept() -> None:
    """The action is the memory, and the memory is the time: each action is the tanh of the previous time."""
    spec = policy_spec()
    policy = NetworkPolicy(Architecture(("time",), (), memory=1), [0, 1, 1, 0, 0, 0])

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
    with pytest.raises(InputError, match="rows: expected 3 rows as before, got 2"):
        policy.reset(np.array([False, True]))


@pytest.mark.parametrize(
    ("fields", "parameters", "message"),
    [
        ({"hidden": (2,)}, np.zeros(6), r"parameters: expected shape \(7,\)"),
        ({}, [0.0, np.nan], r"parameters\[1\]: expected a finite number"),
        ({"hidden": (4, 0)}, [0.0], r"hidden\[1\]: expected an integer from 1"),
        ({"memory": 1, "ranges": (1.0, 2.0)}, [0.0], "memory: expected 0 for a network that scores ranges"),
        ({"inputs": ("wings",)}, [0, 0], "observation: expected an entry 'wings', got"),
        ({"mirror": True}, [0, 0], "observation: expected an entry 'predator_direction_left', got"),
        ({"candidate_inputs": ("range",)}, [0, 0, 0], "profile_ranges: expected candidate ranges"),
    ],
)
def test_networks_that_cannot_act_are_refused(fields: dict[str, Any], parameters: Any, message: str) -> None:
    shared = fe.FlockEscapeEnv(SCENARIO).policy_spec
    with pytest.raises(InputError, match=message):
        NetworkPolicy(Architecture(**{"inputs": ("time",), "hidden": (), **fields}), parameters).act(
            np.zeros((2, len(shared.layout.names)), np.float32), shared
        )


@pytest.mark.parametrize(
    "layers", [[], [nn.Linear(4, 2), nn.ReLU(), nn.Linear(2, 1)], [nn.Linear(4, 2), nn.Tanh()], [nn.Tanh()]]
)
def test_other_layers_are_refused(layers: list[nn.Module]) -> None:
    with pytest.raises(InputError, match="layers: expected Linear and Tanh in turn, Linear first and last"):
        torch_network(layers, ("time",))
