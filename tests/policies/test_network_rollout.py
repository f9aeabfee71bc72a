"""Rollouts of networks and of lines: equality with ``act`` and environments, and reproducible outcomes."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from network_outcomes import SEEDS, cases, hashes, policy_of

import flockesc_env as fe
from flockesc_env.policies import Architecture, FixedRange, Policy, bind

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "network_outcomes.json").read_text())


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


SCENARIO = fe.LineScenario(num_agents=12, max_steps=40)
LINES = [5, 0, 2**64 - 1, 7, 7, 3]


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
