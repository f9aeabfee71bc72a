"""A population of policies plays as each policy does alone."""

from __future__ import annotations

import numpy as np
import pytest
from option_table import small_flock

from flockesc_env import Architecture, Policy, rollout
from training.families import Family, Networks, Population, Witnesses

SCENARIO = small_flock(num_agents=6, num_steps=12, initial_side=60.0)
SEEDS = [4, 5]
INPUTS = ("time", "predator_sensed", "predator_direction_ahead", "predator_direction_left")
FAMILIES = {
    "networks": Networks(Architecture(INPUTS, memory=2)),
    "linear networks": Networks(Architecture(INPUTS, ())),
    "rules": Witnesses(max_range=30.0),
}


@pytest.mark.parametrize("family", FAMILIES.values(), ids=list(FAMILIES))
def test_a_population_plays_as_its_policies_do(family: Family) -> None:
    vectors = np.random.default_rng(0).normal(size=(3, family.size))
    population = Population([family.policy(vector) for vector in vectors])

    def played(policy: Policy, seeds: list[int]) -> np.ndarray:
        return rollout(
            SCENARIO, policy, seeds, per_agent=True, max_range=30.0, batch_size=len(seeds)
        ).min_mean_distance

    for _ in range(2):  # the second run starts without the memory of the first
        together = played(population, SEEDS * 3)
        alone = np.concatenate([played(family.policy(vector), SEEDS) for vector in vectors])
        np.testing.assert_array_equal(together, alone)
    assert len(set(alone.round(3))) >= 3
    assert population.actions == 2 * 6 * SCENARIO.num_agents * SCENARIO.num_steps
