"""The profile in the observation of a line: every entry against NumPy, and the check of its ranges."""

from __future__ import annotations

from typing import get_args

import numpy as np
import reference
from hypothesis import given
from hypothesis import strategies as st
from reference import Floats

from flockesc_env import LineEscapeEnv, LineScenario
from flockesc_env.scenario.line import EscapeForce

RANGES = (0.0, 0.05, 0.25, 0.5, 1.0)


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
