"""Bounds of numbers: values outside are refused by name; values inside never give NaN or infinity."""

import math
from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pytest
from extreme_scenarios import COMPUTED, DIVIDING, LARGEST, SMALLEST, Bounds, flocks
from hypothesis import given, settings
from hypothesis import strategies as st
from option_table import every_pair, small_flock

import flockesc_env as fe
from flockesc_env import scenario as sc
from flockesc_env.policies import Pursue
from flockesc_env.scenario import ConstantVelocity, Learned

BELOW, ABOVE = math.nextafter(SMALLEST, 0), math.nextafter(LARGEST, math.inf)
MAX = 1.7976931348623157e308

LINE_COMPUTED = ("predator_range", "repulsion_strength")

dividing = st.sampled_from([SMALLEST, 1e-9, 0.1, 1.0, 1e12, LARGEST])
computed = st.sampled_from([0.0, 5e-324, 1e-160, 2e-140, 5e-109]) | dividing
compared = st.sampled_from([MAX, 1e154]) | computed
coordinate = st.builds(math.copysign, computed, st.sampled_from([1.0, -1.0]))


line = partial(fe.LineScenario, num_agents=5)
BOUNDS = [
    *((small_flock, field, (SMALLEST, LARGEST), (0.0, 5e-324, BELOW, ABOVE, MAX)) for field in DIVIDING),
    *((small_flock, field, (0.0, 5e-324, LARGEST), (ABOVE,)) for field in COMPUTED),
    *((line, field, (0.0, 5e-324, LARGEST), (ABOVE,)) for field in (*LINE_COMPUTED, "predator_position")),
]
STARTS = ("initial_positions", "initial_velocities", "predator_positions", "predator_velocities")
line_scenarios = st.builds(
    partial(fe.LineScenario, max_steps=20),
    predator_position=coordinate,
    predator_range=computed,
    repulsion_strength=computed,
    escape_force=st.sampled_from(["constant", "linear", "linear_as_printed"]),
)


@pytest.mark.parametrize(("make", "field", "good", "bad"), BOUNDS)
def test_bounds(make: Any, field: str, good: tuple[float, ...], bad: tuple[float, ...]) -> None:
    for value in good:
        assert getattr(make(**{field: value}), field) == value
    for value in bad:
        with pytest.raises(fe.InputError, check=lambda error: error.field == field):
            make(**{field: value})


@settings(max_examples=80)
@given(flocks(Bounds(coordinate, dividing, computed, compared)), st.data())
def test_nothing_is_ever_nan_or_infinite(scenario: fe.FlockScenario, data: st.DataObject) -> None:
    """Random combinations of the largest and smallest numbers, in both views, from drawn and given starts."""
    shape = (scenario.num_agents, scenario.dimension)
    entries = st.lists(coordinate, min_size=math.prod(shape), max_size=math.prod(shape))
    is_given = data.draw(st.booleans())
    start = {name: np.reshape(data.draw(entries), shape) for name in STARTS[:2]} if is_given else {}
    ranges = st.sampled_from([0.0, 1e-20, 1.0, 1e12, 3e38])
    assert_finite(scenario, start, lambda: data.draw(ranges))


def assert_finite(scenario: fe.FlockScenario, start: dict[str, Any], choose: Callable[[], float]) -> None:
    """Play an episode in both views, with chosen ranges, and check every number of it."""
    options: dict[str, Any] = {"action_mode": "range", "max_range": 3e38, "steps_per_action": 1}
    options["extra_entries"] = ("escape_direction", "closest_approach")
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
        rho = np.float32(choose())
        observation, reward, terminated, truncated, info = flock.step(np.array([rho]))
        rows, rewards, *_ = team.step_array(np.full((scenario.num_agents, 1), rho))
        assert np.isfinite(reward)
        assert np.isfinite(rewards).all()
        state = flock._batch.core.state(0)
        for name in ("positions", "velocities", "predator_positions", "predator_velocities"):
            assert np.isfinite(state[name]).all(), name
        is_drawn = "initial_velocities" not in start
        if scenario.constant_speed and is_drawn and info["fraction_surviving"] == 1:
            speeds = np.linalg.norm(state["velocities"], axis=1)
            np.testing.assert_allclose(speeds, scenario.speed, rtol=1e-12)
        has_ended = terminated or truncated


AT_REST: dict[str, Any] = {"position": (0.0, 0.0), "velocity": (0.0, 0.0)}
STEERED = AT_REST | {"max_turn_rate": LARGEST, "max_speed": LARGEST, "acceleration": LARGEST}
HUNTERS: dict[str, tuple[Any, ...]] = {
    "constant_velocity": (sc.ConstantVelocity(**AT_REST),) * 2,
    "wandering": (sc.Wandering(**AT_REST | {"velocity": (1.0, 0.0)}, angular_diffusion=LARGEST),),
    "prescribed_path": (sc.PrescribedPath(((0.0, 0.0), (LARGEST, 0.0)), interval=SMALLEST),),
    "learned": (Learned(**AT_REST, max_acceleration=LARGEST, max_speed=LARGEST),),
    "pure_pursuit": (sc.PurePursuit(**STEERED, confusion_rate=LARGEST, sight=MAX),),
    "intercept": (sc.Intercept(**STEERED, navigation_constant=LARGEST),),
    "attracted": (sc.Attracted(**AT_REST, strength=LARGEST, exponent=10.0, max_speed=LARGEST),),
    "encircle": (sc.Encircle(**STEERED, radius=LARGEST, closing_speed=LARGEST),),
    "herd": (sc.Herd(**STEERED, distance=LARGEST, partner=1), sc.ConstantVelocity(**AT_REST)),
    "default attraction": (sc.Attracted(**AT_REST),),
    "targets": tuple(
        sc.PurePursuit(**STEERED, target=target)  # type: ignore[arg-type]
        for target in ("centroid", "most_isolated", "assigned", "assigned")
    ),
}
LAWS: dict[str, Any] = {
    "inertial": sc.Inertial(),
    "vicsek": sc.Vicsek(),
    "reynolds": sc.Reynolds(LARGEST, LARGEST, MAX),
    "preferred_distance": sc.PreferredDistance(LARGEST, LARGEST, SMALLEST),
    "zones": sc.Zones(1e-130, MAX, LARGEST),
    "first_order": sc.FirstOrder(LARGEST, LARGEST),
}
DISTANCES = (0.0, 5e-324, 1e-200, 1e-140, 2e-140, 1e-120, 5e-109, 1e-60, 1e-8, 1.0, LARGEST / 4)


def test_every_law_and_predator_is_here() -> None:
    kinds = fe._core.kinds()
    assert LAWS.keys() == set(kinds["motions"])
    assert HUNTERS.keys() >= set(kinds["predators"])


@every_pair(law=LAWS, hunters=HUNTERS, distance=DISTANCES)
def test_strengths_at_bounds_are_finite_at_every_distance(law: str, hunters: str, distance: float) -> None:
    places = np.array([[0, 0], [1, 0], [0, 2], [-1, 1], [3, -2]]) * distance
    for rule, is_constant in product((sc.Metric(), sc.Topological(), sc.Voronoi()), (False, True)):
        scenario = small_flock(
            num_steps=3,
            motion=LAWS[law],
            predators=HUNTERS[hunters],
            neighbor_rule=rule,
            constant_speed=is_constant or law in {"vicsek", "zones"},
            predator_range=MAX,
            **dict.fromkeys(COMPUTED, LARGEST),
        )
        for start in ({}, {"initial_velocities": places[::-1]}):
            assert_finite(scenario, {"initial_positions": places, **start}, lambda: 3e38)


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
