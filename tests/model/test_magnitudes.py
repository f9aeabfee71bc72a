"""Bounds of numbers: values outside are refused by name; values inside never give NaN or infinity."""

import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from extreme_scenarios import COMPUTED, DIVIDING, LARGEST, SMALLEST, Bounds, flocks
from hypothesis import given, settings
from hypothesis import strategies as st
from option_table import small_flock

import flockesc_env as fe
from flockesc_env.common.errors import InputError
from flockesc_env.policies import Pursue
from flockesc_env.scenario import ConstantVelocity, Learned

BELOW, ABOVE = math.nextafter(SMALLEST, 0), math.nextafter(LARGEST, math.inf)
MAX = 1.7976931348623157e308

LINE_COMPUTED = ("predator_range", "repulsion_strength")

dividing = st.sampled_from([SMALLEST, 1e-9, 0.1, 1.0, 1e12, LARGEST])
computed = st.sampled_from([0.0, 5e-324, 1e-160]) | dividing
compared = st.sampled_from([MAX, 1e154]) | computed
coordinate = st.builds(math.copysign, computed, st.sampled_from([1.0, -1.0]))


line = partial(fe.LineScenario, num_agents=5)
BOUNDS = [
    *((small_flock, field, (SMALLEST, LARGEST), (0.0, 5e-324, BELOW, ABOVE, MAX)) for field in DIVIDING),
    *((small_flock, field, (0.0, 5e-324, LARGEST), (ABOVE,)) for field in COMPUTED),
    *((line, field, (0.0, 5e-324, LARGEST), (ABOVE,)) for field in (*LINE_COMPUTED, "predator_position")),
]


@pytest.mark.parametrize(("make", "field", "good", "bad"), BOUNDS)
def test_bounds(make: Any, field: str, good: tuple[float, ...], bad: tuple[float, ...]) -> None:
    for value in good:
        assert getattr(make(**{field: value}), field) == value
    for value in bad:
        with pytest.raises(InputError) as caught:
            make(**{field: value})
        assert caught.value.field == field


STARTS = ("initial_positions", "initial_velocities", "predator_positions", "predator_velocities")


@settings(max_examples=80)
@given(flocks(Bounds(coordinate, dividing, computed, compared)), st.data())
def test_nothing_is_ever_nan_or_infinite(scenario: fe.FlockScenario, data: st.DataObject) -> None:
    """Random combinations of the largest and smallest numbers, in both views, from drawn and given starts."""
    shape = (scenario.num_agents, scenario.dimension)
    entries = st.lists(coordinate, min_size=math.prod(shape), max_size=math.prod(shape))
    is_given = data.draw(st.booleans())
    start = {name: np.reshape(data.draw(entries), shape) for name in STARTS[:2]} if is_given else {}
    options = {"action_mode": "range", "max_range": 3e38, "steps_per_action": 1}
    if any(isinstance(predator, Learned) for predator in scenario.predators):
        options["predator_policy"] = Pursue()
    flock = fe.FlockEscapeEnv(scenario, **options)
    team = fe.parallel_env(scenario, **options, reward="individual_distance_change")
    observation, info = flock.reset(seed=1, options=start)
    rows, _ = team.reset_array(seed=1, options=start)
    has_ended = False
    while not has_ended:
        assert flock.observation_space.contains(observation)
        assert ((np.abs(rows) <= 1) | (rows == 0)).all()
        assert np.isfinite(list(info.values())).all()
        rho = np.float32(data.draw(st.sampled_from([0.0, 1e-20, 1.0, 1e12, 3e38])))
        observation, reward, terminated, truncated, info = flock.step(np.array([rho]))
        rows, rewards, *_ = team.step_array(np.full((scenario.num_agents, 1), rho))
        assert np.isfinite(reward)
        assert np.isfinite(rewards).all()
        state = flock._batch.core.state(0)
        for name in ("positions", "velocities", "predator_positions", "predator_velocities"):
            assert np.isfinite(state[name]).all(), name
        is_kept = scenario.constant_speed and not is_given and info["fraction_surviving"] == 1
        if is_kept:
            speeds = np.linalg.norm(state["velocities"], axis=1)
            np.testing.assert_allclose(speeds, scenario.speed, rtol=1e-12)
        has_ended = terminated or truncated


def test_agents_at_tiny_distances_count_as_coincident() -> None:
    """Offsets whose squares are 0 have no direction and give no force; all agents are neighbors."""
    scenario = small_flock(num_steps=3, predators=(ConstantVelocity((0.0, 0.0), (0.0, 0.0)),))
    for tiny in (5e-324, 1e-300, 1e-170):
        positions = np.arange(10.0).reshape(5, 2) * tiny
        run = fe.simulate(scenario, 0.0, seed=1, initial_positions=positions)
        assert run.num_components[0] == 1
        together = fe.simulate(scenario, 0.0, seed=1, initial_positions=np.zeros((5, 2)))
        np.testing.assert_allclose(run.velocities, together.velocities, rtol=1e-15)
        assert run.mean_distance[0] == 0


line_scenarios = st.builds(
    partial(fe.LineScenario, max_steps=20),
    predator_position=coordinate,
    predator_range=computed,
    repulsion_strength=computed,
    escape_force=st.sampled_from(["constant", "linear", "linear_as_printed"]),
)


@settings(max_examples=150)
@given(st.lists(coordinate, min_size=1, max_size=12), line_scenarios, compared)
def test_the_line_is_finite_and_equals_its_mirror_image(
    states: list[float], scenario: fe.LineScenario, rho: float
) -> None:
    scenario = scenario.replace(num_agents=len(states))
    run = fe.simulate_line(scenario, rho, initial_state=states)
    assert np.isfinite(run.states).all()
    assert np.isfinite(run.escape_distance).all()
    mirrored = scenario.replace(predator_position=-(scenario.predator_position or 0.0))
    image = fe.simulate_line(mirrored, rho, initial_state=[-x for x in states])
    np.testing.assert_array_equal(image.states, -run.states)
    np.testing.assert_array_equal(image.escape_distance, run.escape_distance)
