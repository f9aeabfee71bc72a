"""Every observation entry against its definition in docs/model.md."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from observation_reference import Reference, assert_plays_as, flocks, random_start

from flockesc_env import EnvOptions, FlockScenario


@settings(max_examples=80)
@given(flocks())
def test_flock_view(case: tuple[FlockScenario, EnvOptions, np.random.Generator]) -> None:
    scenario, options, rng = case
    state = random_start(scenario, rng)
    if rng.random() < 0.5:
        state.velocities[rng.integers(scenario.num_agents)] = 0.0
    # A single predator exactly at the centroid has no direction from it, but rounding would give it one.
    if scenario.num_agents > 1 and rng.random() < 0.3:
        state.positions[rng.integers(scenario.num_agents)] = state.predator_positions[0]
    assert_plays_as(Reference(scenario, options, state), rng, per_agent=False)


@settings(max_examples=80)
@given(flocks())
def test_agent_view(case: tuple[FlockScenario, EnvOptions, np.random.Generator]) -> None:
    scenario, options, rng = case
    assert_plays_as(Reference(scenario, options, random_start(scenario, rng)), rng, per_agent=True)
