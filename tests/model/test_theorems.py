"""The paper's statements about the line: exact counterexamples, and the statements that hold.

The predator is at 0. Numbers are dyadic and few, so states and ties are exact unless a test says otherwise.
"""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flockesc_env import LineScenario, simulate_line
from flockesc_env.models import LineTrajectory


def run_line(states: list[float], rho: float, **fields: Any) -> LineTrajectory:
    scenario = LineScenario(**{"num_agents": len(states), "predator_position": 0.0, **fields})
    return simulate_line(scenario, rho, initial_state=states)


def test_a_connected_line_need_not_converge_to_the_average_of_its_start() -> None:
    """Section III and Definition 1. Three agents are the smallest case; two agents meet at their average.

    (0, 2, 3) goes to (1, 5/3, 5/2), a complete graph, and then to its average 31/18, not to 5/3.
    """
    run = run_line([0, 2, 3], 2.0, predator_position=None)
    assert (run.num_components == 1).all()
    assert run.converged
    limit = float((Fraction(1) + Fraction(5, 3) + Fraction(5, 2)) / 3)
    np.testing.assert_allclose(run.states[-1], limit, rtol=2**-50)  # two steps of the engine's resolution
    assert abs(limit - 5 / 3) > 0.05


def test_a_longer_range_can_break_up_a_line_that_a_shorter_one_holds_together() -> None:
    """Section I: a longer range makes connectivity likelier, not certain. No shorter line of integers
    up to 10 has this property.
    """
    states = [0.0, 0.0, 1.0, 3.0, 5.0, 7.0]
    assert run_line(states, 2.0, predator_position=None).num_components[-1] == 1
    assert run_line(states, 3.0, predator_position=None).num_components[-1] == 2


def test_a_predator_can_unite_components() -> None:
    """Lemma 1 needs f = 0: here the escape force moves the agent in range onto the other one."""
    run = run_line([0.5, 2.5], 0.5, predator_range=1.0, repulsion_strength=2.0, escape_force="constant")
    assert run.num_components.tolist() == [2, 1, 1]


def test_an_agent_out_of_range_can_be_pulled_into_it() -> None:
    """(10) fails for s = s* = rho_p + rho: an agent out of range feels no force but hears others."""
    run = run_line([0.75, 1.0], 0.5, predator_range=1.0, repulsion_strength=1.5, escape_force="constant")
    assert run.states.tolist()[:3] == [[0.75, 1.0], [2.375, 0.875], [2.375, 2.375]]
    assert run.converged


def test_an_agent_on_the_predator_stays_and_the_line_still_converges() -> None:
    """Inequality (10) fails forever at x_i = x_p, but lim x(t) exists."""
    run = run_line([-2.0, 0.0, 2.0], 0.5, predator_range=1.0, repulsion_strength=1.5, escape_force="constant")
    assert run.converged
    assert run.escape_distance[-1] == 0


@st.composite
def attacked_lines(draw: st.DrawFn) -> tuple[list[float], float]:
    """Draw states and rho <= rho_p = 1 on one lattice, so that ties at both boundaries are common."""
    parts = draw(st.sampled_from([1, 2, 4, 8, 16]))
    units = st.integers(-3 * parts, 3 * parts).filter(bool)
    states = draw(st.lists(units, min_size=1, max_size=40))
    return [x / parts for x in states], draw(st.integers(0, parts)) / parts


def depths_in_range(states: np.ndarray, side: int) -> np.ndarray:
    """Return the depths rho_p - |x_i| of the agents in range on one side of the predator."""
    return 1 - np.abs(states[(states * side > 0) & (np.abs(states) < 1)])


@given(
    attacked_lines(), st.sampled_from([0.0, 0.25, 3.0]), st.sampled_from(["constant", "linear_as_printed"])
)
def test_theorem_2_holds_off_the_predator_though_its_proof_does_not(
    line: tuple[list[float], float], more: float, force: str
) -> None:
    """If no agent starts on the predator, rho <= rho_p and s >= s*, no agent is in range in the end.

    s* = rho_p + rho for Eq. 8 and 1 + rho / rho_p for Eq. 9 as printed. No agent changes sides, agents in
    range leave it, and only agents in range pull others in. On one side let D be the sum of rho_p - |x_i|
    over agents in range. The k agents that are pulled in hear one another and an agent in range, so D
    falls to k / (k + 1) D or less. Once D < min(rho / n, rho_p / 2) on both sides, only agents less than D
    outside rho_p can be pulled in, and no agent joins those: after n steps no agent is in range.
    """
    states, rho = line
    run = run_line(states, rho, predator_range=1.0, repulsion_strength=1 + rho + more, escape_force=force)
    assert run.converged
    assert (np.sign(run.states) == np.sign(run.states[0])).all()
    assert run.escape_distance[-1] >= 1
    rounding = 2**-46  # for states below 32 in sums over at most 40 agents
    for before, after in zip(run.states, run.states[1:], strict=False):
        for side in (-1, 1):
            was, now = depths_in_range(before, side), depths_in_range(after, side)
            assert now.sum() <= was.sum() * len(now) / (len(now) + 1) + rounding
        assert not ((np.abs(before) < 1) & (np.abs(after) < 1 - rounding)).any()


@pytest.mark.parametrize(
    ("force", "predator_range", "rho", "states"),
    [
        ("linear", 3.0, 4.0, [-3.0, 1.0]),
        ("linear", 2.0, 4.0, [-3.0, -1.0, 1.0]),
        ("linear_as_printed", 5.0, 8.0, [-6.0, 2.0]),
    ],
)
def test_with_rho_above_rho_p_a_line_can_oscillate_forever(
    force: str, predator_range: float, rho: float, states: list[float]
) -> None:
    """The limit in Definition 2 does not exist for Eq. 9, s = 2 and rho > rho_p, a case of Figure 5.

    The period is 2: the agents in and out of range change places, or sides.
    """
    run = run_line(states, rho, predator_range=predator_range, repulsion_strength=2.0, escape_force=force)
    assert not run.converged
    assert run.states[1].tolist() != states
    assert (run.states[::2] == states).all()
    assert (run.states[1::2] == run.states[1]).all()


@pytest.mark.parametrize("seed", range(5))
def test_the_best_range_of_a_line_is_an_interval(seed: int) -> None:
    """Problem 1 has no single solution: rho acts only through the graphs, so d_ss(rho) is a step function.

    No run changes if rho grows up to the next distance between any two agents at any time.
    """
    scenario, rho = LineScenario(), 0.1
    run = simulate_line(scenario, rho, seed=seed)
    distances = np.concatenate([np.abs(x[:, None] - x[None, :]).ravel() for x in run.states])
    following = float(distances[distances > rho].min())
    assert following > rho
    below = simulate_line(scenario, float(np.nextafter(following, 0)), seed=seed)
    np.testing.assert_array_equal(below.states, run.states)
    assert not np.array_equal(simulate_line(scenario, following, seed=seed).states, run.states)


def test_the_lines_of_figure_5_leave_a_constant_force_within_three_steps() -> None:
    """For s = s* and rho = rho_p, inequality (10) fails at t* = 0 for most lines and holds from t* = 2 on."""
    scenario = LineScenario(escape_force="constant", repulsion_strength=0.4)
    runs = [simulate_line(scenario, 0.2, seed=seed) for seed in range(400)]
    in_range = [(np.abs(run.states - 0.6) < 0.2).any(axis=1) for run in runs]
    assert sum(bool(now[1]) for now in in_range) > 200
    assert max(int(np.flatnonzero(now).max()) for now in in_range) < 3
    assert all(run.converged for run in runs)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.sampled_from([0.0, 0.0213, 0.0871, 0.31, 2.0]))
def test_a_line_without_a_predator_never_expands_or_reunites(seed: int, n: int, rho: float) -> None:
    """Lemma 1: m(t) never falls. Averages stay within the convex hull."""
    trajectory = simulate_line(LineScenario(num_agents=n, predator_position=None), rho, seed=seed)
    assert trajectory.converged
    assert (np.diff(trajectory.num_components) >= 0).all()
    hull = np.stack([trajectory.states.min(axis=1), -trajectory.states.max(axis=1)])
    assert (np.diff(hull, axis=1) >= -1e-15).all()
    order = np.argsort(trajectory.states[0])  # agents never overtake each other
    assert (np.diff(trajectory.states[:, order], axis=1) >= -1e-15).all()
