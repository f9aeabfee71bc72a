"""The core against the NumPy models, on small random configurations and edge cases."""

from functools import partial

import numpy as np
import pytest
import reference
from hypothesis import given, settings
from hypothesis import strategies as st
from predator_reference import PACKS

import flockesc_env as fe
from flockesc_env import scenario as sc

SIDE = 40.0
HUGE = 1e200  # its square is not a finite number
STEPS = 5
LINE_STEPS = 8

seeds = st.integers(0, 2**32 - 1)
line_scenarios = st.builds(
    partial(fe.LineScenario, tolerance=0.0, max_steps=LINE_STEPS),
    num_agents=st.integers(1, 70),
    predator_position=st.sampled_from([None, 0.6, -0.05, 0.0]),
    predator_range=st.sampled_from([0.0, 0.2, 5.0]),
    repulsion_strength=st.sampled_from([0.0, 0.37, 2.0]),
    escape_force=st.sampled_from(["constant", "linear", "linear_as_printed"]),
)


@st.composite
def per_agent(draw: st.DrawFn, agents: int, values: tuple[float, ...]) -> float | np.ndarray:
    """Draw one value for all agents, or one per agent."""
    shape = draw(st.sampled_from([None, agents]))
    return np.random.default_rng([draw(seeds), 3]).choice(values, shape)


@st.composite
def flock_scenarios(draw: st.DrawFn) -> fe.FlockScenario:
    dimension = draw(st.sampled_from([2, 3]))
    agents = draw(st.integers(1, 70))
    rng = np.random.default_rng([draw(seeds), 1])
    starts = [(rng.uniform(0, SIDE, dimension), rng.uniform(-16, 16, dimension)) for _ in range(7)]
    motion = draw(
        st.sampled_from(
            # Unequal weights, so that forces do not cancel up to rounding errors, which would be the heading.
            [
                sc.Inertial(),
                sc.Vicsek(),
                sc.Reynolds(1.0, 0.7),
                sc.Reynolds(2.0, 0.5, 12.0),
                sc.Reynolds(3.0, 0.0, HUGE),
                sc.PreferredDistance(2.0, 4.0, 1.5),
                sc.Zones(2.0, 12.0, 3.0),
                sc.Zones(0.0, HUGE, 100.0),
                sc.FirstOrder(30.0, 0.4),
            ]
        )
    )
    return fe.FlockScenario(
        num_agents=agents,
        dimension=dimension,
        num_steps=STEPS,
        time_step=draw(st.sampled_from([0.05, 0.3])),
        mass=draw(per_agent(agents, (0.1, 2.0))),
        speed=draw(per_agent(agents, (0.5, 10.0))),
        predator_range=draw(st.sampled_from([0.0, 15.0, HUGE])),
        repulsion_strength=draw(per_agent(agents, (0.0, 10.0))),
        alignment_strength=draw(per_agent(agents, (0.0, 0.7, 1.0))),
        motion=motion,
        sensing_delay=draw(st.sampled_from([0, 1, 3, STEPS])),
        capture_radius=draw(st.sampled_from([None, None, 0.5, 4.0, 10.0])),
        constant_speed=isinstance(motion, sc.Vicsek | sc.Zones) or draw(st.booleans()),
        blocks_warnings=draw(st.booleans()),
        predators=draw(st.sampled_from([lambda _: (), *PACKS.values()]))(starts),
    )


@st.composite
def ranges(draw: st.DrawFn, agents: int, special: tuple[float, ...], largest: float) -> np.ndarray:
    """Draw ranges of every shape that ``simulate`` takes; random ranges never equal a distance."""
    shape = draw(st.sampled_from([(1, 1), (1, agents), (STEPS, 1), (STEPS, agents)]))
    rng = np.random.default_rng([draw(seeds), 2])
    values = rng.uniform(0, largest, shape)
    at = rng.random(shape) < draw(st.sampled_from([0.0, 0.3, 1.0]))
    return np.where(at, rng.choice(special, shape), values)


def random_start(scenario: fe.FlockScenario, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw a flock with coincident agents, agents on the first predator, and agents at rest."""
    shape = (scenario.num_agents, scenario.dimension)
    positions, velocities = rng.uniform(0, SIDE, shape), rng.normal(0, np.max(scenario.speed), shape)
    start = reference.flock_start(scenario, positions, velocities)
    resting, at_start, on_predator = rng.integers(0, scenario.num_agents, 3)
    if rng.random() < 0.5:
        positions[at_start] = positions[0]
    if rng.random() < 0.5:
        velocities[resting] = 0.0
    # A predator with its target exactly behind may turn to either side, so the target moves.
    if len(start.predator_positions) and on_predator != resting and rng.random() < 0.5:
        positions[on_predator] = start.predator_positions[0]
    return positions, velocities


@settings(max_examples=150)
@given(st.data(), flock_scenarios(), seeds)
def test_flock(data: st.DataObject, scenario: fe.FlockScenario, seed: int) -> None:
    rho = data.draw(ranges(scenario.num_agents, (0.0, SIDE * 10, HUGE), SIDE))
    schedule = np.broadcast_to(rho, (STEPS, scenario.num_agents))
    if len(rho) == 1:
        given = {"interaction_range": rho[0, 0] if rho.size == 1 else rho[0]}
    else:
        given = {"policy": fe.ScheduledRange(rho if rho.shape[1] > 1 else rho[:, 0])}
    positions, velocities = random_start(scenario, np.random.default_rng(seed))
    run = fe.simulate(scenario, **given, initial_positions=positions, initial_velocities=velocities)
    np.testing.assert_array_equal(run.positions[0], positions)
    np.testing.assert_array_equal(run.velocities[0], velocities)
    reference.assert_follows(run, schedule)


@pytest.mark.parametrize("constant_speed", [True, False])
def test_opposite_velocities_give_no_consensus_force(constant_speed: bool) -> None:
    """A mean velocity of exactly 0 has no direction, so both agents fly straight on."""
    scenario = fe.FlockScenario(num_agents=2, num_steps=3, predators=(), constant_speed=constant_speed)
    velocities = [[6.0, 8.0], [-6.0, -8.0]]
    run = fe.simulate(scenario, 50.0, initial_positions=[[0, 0], [1, 0]], initial_velocities=velocities)
    np.testing.assert_allclose(run.velocities, np.broadcast_to(velocities, (4, 2, 2)), rtol=1e-15)


@pytest.mark.parametrize(("constant_speed", "expected"), [(True, -8.0), (False, 0.0)])
def test_agent_brought_to_rest(constant_speed: bool, expected: float) -> None:
    """Consensus and escape force cancel the velocity exactly; it becomes 0 only under the literal law."""
    law = {"time_step": 0.5, "mass": 0.5, "repulsion_strength": 18.0, "constant_speed": constant_speed}
    predators = (sc.ConstantVelocity((-3.0, 0.0), (0.0, 0.0)),)
    scenario = fe.FlockScenario(num_agents=1, num_steps=1, predators=predators, **law)
    run = fe.simulate(scenario, 1.0, initial_positions=[[0.0, 0.0]], initial_velocities=[[-8.0, 0.0]])
    assert run.velocities[1].tolist() == [[expected, 0.0]]


def test_boundaries_of_the_flock_are_inclusive() -> None:
    """3-4-5 triangles: distances of exactly rho and rho_p are in range, slightly larger ones are not."""
    predators = (sc.ConstantVelocity((0.0, 0.0), (0.0, 0.0)),)
    scenario = fe.FlockScenario(num_agents=2, num_steps=1, predator_range=5.0, predators=predators)
    start = {"initial_positions": [[3.0, 4.0], [6.0, 8.0]], "initial_velocities": [[10.0, 0.0], [0.0, 10.0]]}
    touching = fe.simulate(scenario, 5.0, **start)
    assert touching.num_components.tolist()[0] == 1
    assert touching.velocities[1, 1, 0] > 0  # the second agent heard the first
    assert touching.velocities[1, 0, 1] > 0
    apart = fe.simulate(scenario, np.nextafter(5.0, 0), **start)
    assert apart.num_components.tolist()[0] == 2
    np.testing.assert_allclose(apart.velocities[1, 1], [0.0, 10.0], atol=1e-12)
    assert apart.velocities[1, 0, 1] > 0  # pushed by the predator at exactly rho_p
    blind = fe.simulate(scenario.replace(predator_range=np.nextafter(5.0, 0)), 0.0, **start)
    np.testing.assert_allclose(blind.velocities[1], start["initial_velocities"], atol=1e-12)


@settings(max_examples=250)
@given(line_scenarios, seeds, st.sampled_from([0.0, 0.013, 0.0941, 0.2718, 0.66, 10.0, HUGE]))
def test_line(scenario: fe.LineScenario, seed: int, rho: float) -> None:
    rng = np.random.default_rng(seed)
    states = rng.uniform(-0.1, 1, scenario.num_agents)
    if scenario.predator_position is not None and rng.random() < 0.3:
        states[rng.integers(scenario.num_agents)] = scenario.predator_position
    states[rng.integers(scenario.num_agents)] = states[0]
    run = fe.simulate_line(scenario, rho, initial_state=states)
    for t in range(run.steps + 1):
        np.testing.assert_allclose(run.states[t], states, rtol=0, atol=1e-9, err_msg=f"step {t}")
        assert run.num_components[t] == reference.line_components(run.states[t], rho)
        if scenario.predator_position is None:
            assert run.escape_distance[t] == np.inf
        else:
            nearest = np.abs(states - scenario.predator_position).min()
            np.testing.assert_allclose(run.escape_distance[t], nearest, rtol=0, atol=1e-9)
        states = reference.line_step(scenario, states, rho)
    moves = np.abs(np.diff(run.states, axis=0)).max(axis=1)
    assert run.converged == (moves[-1] <= scenario.tolerance)
    assert run.converged or run.steps == LINE_STEPS
    assert (moves[:-1] > scenario.tolerance).all()


def test_boundaries_of_the_line() -> None:
    """The boundary of rho is inclusive, that of rho_p exclusive; there is no force at x_i = x_p."""
    scenario = fe.LineScenario(
        num_agents=3, predator_position=0.0, predator_range=0.5, escape_force="constant", max_steps=1
    )
    apart = fe.simulate_line(scenario, 0.0, initial_state=[0.0, 0.25, 0.5])
    assert apart.states[1].tolist() == [0.0, 2.25, 0.5]
    heard = fe.simulate_line(scenario.replace(repulsion_strength=0), 0.25, initial_state=[0.0, 0.25, 0.5])
    assert heard.states[1].tolist() == [0.125, 0.25, 0.375]
    assert heard.num_components.tolist() == [1, 1]
