"""Networks as policies: the range with the highest score, memory, and networks that are refused.

``test_network_rollout.py`` holds their bits.
"""

from typing import Any

import numpy as np
import pytest
from option_table import small_flock
from torch import nn

import flockesc_env as fe
from flockesc_env.episodes.spaces import PolicySpec
from flockesc_env.policies import Architecture, torch_network

EPS = float(np.finfo(np.float32).eps)
"""The core computes in float64; actions, at most 1 in magnitude, are rounded to float32."""
SCENARIO = small_flock(num_agents=6, num_steps=12, predator_range=60.0)


def policy_spec(scenario: fe.FlockScenario = SCENARIO, **options: Any) -> PolicySpec:
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
    with pytest.raises(fe.InputError, match=message):
        fe.NetworkPolicy(Architecture(**{"inputs": ("time",), "hidden": (), **fields}), parameters).act(
            np.zeros((2, len(shared.layout.names)), np.float32), shared
        )


@pytest.mark.parametrize(
    "layers",
    [
        [],
        [nn.Linear(4, 2), nn.ELU(), nn.Linear(2, 1)],
        [nn.Linear(4, 2), nn.ReLU(), nn.Linear(2, 2), nn.Tanh(), nn.Linear(2, 1)],
        [nn.Linear(4, 2), nn.Tanh()],
        [nn.Tanh()],
    ],
)
def test_other_layers_are_refused(layers: list[nn.Module]) -> None:
    expected = "layers: expected Linear and Tanh, or Linear and ReLU, in turn, Linear first and last"
    with pytest.raises(fe.InputError, match=rf"{expected} .*torch.nn.Tanh"):
        torch_network(layers, ("time",))
