"""The profile in the observation of a line: every entry against NumPy, and the check of its ranges."""

from __future__ import annotations

import json
from typing import Any, get_args

import numpy as np
import pytest
import reference
from hypothesis import given
from hypothesis import strategies as st
from reference import Floats

from flockesc_env import LineEscapeEnv, LineOptions, LineScenario, _core, rollout
from flockesc_env.common.errors import OptionError, ScenarioError
from flockesc_env.episodes.options import MAX_PROFILE_RANGES
from flockesc_env.policies import FixedRange
from flockesc_env.scenario.line import EscapeForce

RANGES = (0.0, 0.05, 0.25, 0.5, 1.0)
BAD_RANGES: dict[str, tuple[list[Any], str]] = {
    "empty": ([], "1 to 64"),
    "too many": (np.linspace(0, 1, MAX_PROFILE_RANGES + 1).tolist(), "1 to 64"),
    "negative": ([-0.1, 0.2], "0"),
    "above max_range": ([0.1, 1.5], "1"),
    "equal": ([0.1, 0.1], "increasing"),
    "decreasing": ([0.2, 0.1], "increasing"),
}


def scaled(offset: float) -> float:
    return offset / (1 + abs(offset))


def expected_entries(scenario: LineScenario, states: Floats, rho: float) -> list[float]:
    """Return the entries of one candidate range."""
    predator = scenario.predator_position
    assert predator is not None
    after = reference.line_step(scenario, states, rho)
    flight = reference.line_step(scenario, after, 0.0)
    others = reference.line_components(after, rho) - 1
    return [
        scaled(np.abs(after - predator).min()),
        scaled(np.abs(flight - predator).min()),
        scaled((after - predator).mean()),
        others / (others + 8),
        float(np.abs(after - states).max() <= scenario.tolerance),
    ]


@given(
    escape_force=st.sampled_from(get_args(EscapeForce)),
    seed=st.integers(0, 1000),
    actions=st.lists(st.floats(0, 1), min_size=1, max_size=4),
    ranges=st.sampled_from([RANGES, RANGES[:1], RANGES[1:4]]),
)
def test_every_entry_is_that_of_the_reference(
    escape_force: EscapeForce, seed: int, actions: list[float], ranges: tuple[float, ...]
) -> None:
    scenario = LineScenario(num_agents=12, escape_force=escape_force, tolerance=1e-6)
    env = LineEscapeEnv(scenario, action_mode="range", profile_ranges=ranges)
    plain = LineEscapeEnv(scenario, action_mode="range")
    observation, blind = env.reset(seed=seed)[0], plain.reset(seed=seed)[0]
    for action in actions:
        states = np.array(env.line.states)
        profile = np.concatenate([expected_entries(scenario, states, rho) for rho in ranges])
        np.testing.assert_array_equal(observation[: len(blind)], blind)
        np.testing.assert_allclose(observation[len(blind) :], profile, rtol=0, atol=1e-6)
        assert env.observation_space.contains(observation)
        if plain._episode is None or plain._episode.has_ended:
            break
        observation, blind = env.step([np.float32(action)])[0], plain.step([np.float32(action)])[0]


def test_a_step_under_a_candidate_range_does_what_the_profile_says() -> None:
    for k, rho in enumerate(RANGES):
        env = LineEscapeEnv(action_mode="range", profile_ranges=RANGES, max_range=1.0)
        names = env.policy_spec.layout.names
        before = dict(zip(names, env.reset(seed=3)[0], strict=True))
        after = dict(zip(names, env.step([rho])[0], strict=True))
        assert before[f"profile_{k}_escape_distance"] == after["escape_distance"]
        assert before[f"profile_{k}_flight_distance"] == after["profile_0_escape_distance"]


def test_the_profile_changes_no_outcome() -> None:
    blind = rollout(LineScenario(), FixedRange(0.1), range(5))
    informed = rollout(LineScenario(), FixedRange(0.1), range(5), profile_ranges=RANGES)
    np.testing.assert_array_equal(informed.escape_distance, blind.escape_distance)


@pytest.mark.parametrize(("ranges", "reason"), BAD_RANGES.values(), ids=BAD_RANGES)
def test_bad_ranges_are_refused_by_python_and_the_core(ranges: list[Any], reason: str) -> None:
    with pytest.raises(OptionError, match=reason) as caught:
        LineOptions(profile_ranges=ranges)
    assert caught.value.field == "profile_ranges"
    document = json.dumps(json.loads(LineOptions().to_core()) | {"profile_ranges": ranges})
    with pytest.raises(ScenarioError, match=reason) as refused:
        _core.LineEpisode(LineScenario().to_json(), document, 0)
    assert refused.value.field.startswith("profile_ranges")
