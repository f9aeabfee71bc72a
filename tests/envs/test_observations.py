"""Every observation entry against its definition in docs/model.md, in plain NumPy."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observation_reference import Reference, assert_plays_as, flocks, random_start
from option_table import EVERY_STEP

import flockesc_env as fe
from flockesc_env.episodes.batch import FlockBatch
from flockesc_env.episodes.options import View
from flockesc_env.scenario import Reynolds, Topological, Voronoi

RANGES = (0.0, 9.0, 40.0)
ENTRIES = ("escape_direction", "closest_approach")


@pytest.mark.parametrize("per_agent", [False, True])
@settings(max_examples=80)
@given(case=flocks(), has_all=st.booleans())
def test_entries(
    case: tuple[fe.FlockScenario, fe.EnvOptions, np.random.Generator], has_all: bool, *, per_agent: bool
) -> None:
    scenario, options, rng = case
    if has_all:
        options = options.replace(profile_ranges=RANGES if per_agent else None, extra_entries=ENTRIES)
    state = random_start(scenario, rng)
    agent, chance = rng.integers(scenario.num_agents), rng.random()
    if not per_agent and chance < 0.5:
        state.velocities[agent] = 0.0
    elif not per_agent and chance < 0.7 and scenario.num_agents > 1:
        # A single predator exactly at the centroid has no direction from it, but rounding would give it one.
        # An agent without a velocity would be exactly behind the predator, which can turn either way.
        state.positions[agent] = state.predator_positions[0]
    assert_plays_as(Reference(scenario, options, state), rng, per_agent=per_agent)


@pytest.mark.parametrize(
    "changes",
    [
        {"neighbor_rule": Topological()},
        {"neighbor_rule": Voronoi()},
        {"blind_angle": 2.0},
        {"mutual": True},
        {"motion": Reynolds()},
    ],
    ids=str,
)
def test_candidates_are_what_the_agents_hear_after_they_chose_them(changes: dict[str, Any]) -> None:
    """After a step under rho_k, the heard velocity is candidate k of the observation before."""
    scenario = fe.FlockScenario(num_agents=70, **changes)
    ranges = (0.0, 3.0, 11.0, 40.0)
    options = fe.EnvOptions(action_mode="range", profile_ranges=ranges, **EVERY_STEP)
    batch = FlockBatch(scenario, options, num_flocks=len(ranges), view=View.AGENT)
    batch.reset(range(len(ranges)), [7] * len(ranges))
    actions = np.repeat(np.array(ranges, np.float32), 70)[:, None]
    columns = batch.policy_spec.layout.index
    for _ in range(3):
        before = batch.observe(range(len(ranges))).reshape(len(ranges), 70, -1)
        after = batch.step(actions)[0].reshape(len(ranges), 70, -1)
        for k in range(len(ranges)):
            count = after[k, :, columns("neighbor_count")]
            np.testing.assert_array_equal(before[k, :, columns(f"profile_{k}_neighbor_count")], count)
            heard = before[k][:, [columns(f"profile_{k}_velocity_{axis}") for axis in ("ahead", "left")]]
            told = after[k][:, [columns(f"heard_velocity_{axis}") for axis in ("ahead", "left")]]
            # The frame has turned; the length has not.
            lengths = np.linalg.norm(heard, axis=1), np.linalg.norm(told, axis=1)
            np.testing.assert_allclose(*lengths, atol=1e-6)


@pytest.mark.parametrize(
    ("frozen_graph", "view", "error"), [(True, View.AGENT, fe.InputError), (False, View.FLOCK, fe.InputError)]
)
def test_flocks_without_a_profile_are_refused(frozen_graph: bool, view: View, error: type[Exception]) -> None:
    scenario, options = fe.FlockScenario(frozen_graph=frozen_graph), fe.EnvOptions(profile_ranges=RANGES)
    with pytest.raises(error, match="profile_ranges: expected none with"):
        FlockBatch(scenario, options, view=view)
