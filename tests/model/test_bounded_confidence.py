"""Published results on the line without a predator: the Hegselmann-Krause model of bounded confidence.

None of them comes from the paper or from this project. Exact rational arithmetic checks them first: rational
states stay rational, so ties at distance rho are decided without rounding.
"""

from collections import Counter
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from flockesc_env import LineScenario, simulate_line
from flockesc_env.models import LineTrajectory

States = list[Fraction]


def exact_step(states: States, rho: Fraction) -> States:
    """Return the next state by Eq. 1, in exact arithmetic."""
    heard = [[y for y in states if abs(x - y) <= rho] for x in states]
    return [sum(neighbors, Fraction(0)) / len(neighbors) for neighbors in heard]


def exact_run(states: States, rho: Fraction) -> list[States]:
    """Return the states at t = 0, 1, ... up to the freezing time, the first t with x(t+1) = x(t)."""
    run = [states]
    while (following := exact_step(run[-1], rho)) != run[-1]:
        run.append(following)
    return run


def fast_run(states: States, rho: float = 1.0) -> LineTrajectory:
    scenario = LineScenario(num_agents=len(states), predator_position=None, max_steps=20_000)
    run = simulate_line(scenario, rho, initial_state=[float(x) for x in states])
    assert run.converged
    return run


def freezing_time(run: LineTrajectory) -> int:
    """Return the number of steps before the first one that moves no agent."""
    return run.steps - 1


def assert_is(run: LineTrajectory, exact: list[States]) -> None:
    """Compare states at all times. Means do not amplify errors, so the errors of the steps at most add up.

    In one step a mean of states up to M has an error of 2^-51 M (the engine's resolution) and half an ulp.
    """
    assert freezing_time(run) == len(exact) - 1
    largest = max(abs(x) for x in exact[0])
    for t, states in enumerate(exact):
        error = np.abs(run.states[t] - np.array([float(x) for x in states])).max()
        assert error <= (t + 1) * 2**-50 * float(largest)


def equally_spaced(n: int) -> States:
    return [Fraction(k) for k in range(n)]


def cluster_sizes(run: LineTrajectory) -> list[int]:
    """Return the sizes of clusters from left to right; agents in one cluster have the same bits."""
    return list(np.unique(run.states[-1], return_counts=True)[1])


@pytest.mark.parametrize("n", range(1, 31))
def test_equally_spaced_agents_break_off_in_threes(n: int) -> None:
    """P. Hegarty, E. Wedin, "The Hegselmann-Krause dynamics for equally spaced agents", arXiv:1406.0819.

    With gaps equal to the confidence bound, a group of 3 leaves either end every 5 steps; in the end
    2 floor(n/6) clusters have 3 agents and one in the middle n mod 6; the freezing time is 5n/6 + O(1).
    """
    exact = exact_run(equally_spaced(n), Fraction(1))
    threes, middle = divmod(n, 6)
    expected = [3] * threes + [middle] * (middle > 0) + [3] * threes
    assert [size for _, size in sorted(Counter(exact[-1]).items())] == expected
    run = fast_run(exact[0])
    assert_is(run, exact)
    assert cluster_sizes(run) == expected


@pytest.mark.parametrize("n", [62, 99, 256, 1001])
def test_a_long_chain_loses_a_group_at_either_end_every_five_steps(n: int) -> None:
    """The theorem for chains too long for fractions; its O(1) is the time of the last n mod 6 + 6 agents."""
    run = fast_run(equally_spaced(n))
    threes, middle = divmod(n, 6)
    assert cluster_sizes(run) == [3] * threes + [middle] * (middle > 0) + [3] * threes
    rest = len(exact_run(equally_spaced(middle + 6), Fraction(1))) - 1
    assert freezing_time(run) == 5 * (threes - 1) + rest
    breaks = np.flatnonzero(np.diff(run.num_components))
    assert set(np.diff(breaks[: threes - 1])) == {5}
    assert set(np.diff(run.num_components)[breaks[: threes - 1]]) == {2}


def dumbbell(n: int) -> States:
    return [Fraction(-1, n)] * n + equally_spaced(n + 1) + [n + Fraction(1, n)] * n


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_a_small_dumbbell_is_exact(n: int) -> None:
    exact = exact_run(dumbbell(n), Fraction(1))
    assert_is(fast_run(exact[0]), exact)


def test_a_dumbbell_takes_quadratic_time() -> None:
    """E. Wedin, P. Hegarty, "A quadratic lower bound for the convergence rate in the one-dimensional
    Hegselmann-Krause bounded confidence dynamics", Discrete Comput. Geom. 53 (2015), arXiv:1406.0769.

    The freezing time is Omega(n^2) on a chain with gaps equal to the bound between two heavy ends: while the
    chain holds, it is diffusion. If distance rho were out of range, the chain would freeze at once.
    """
    times = np.array([freezing_time(fast_run(dumbbell(n))) for n in (16, 32, 64, 128)])
    growth = times[1:] / times[:-1]
    assert (times >= np.array([16, 32, 64, 128]) ** 2 / 4).all()
    assert (growth > 3).all()
    assert (np.diff(growth) > 0).all(), "doubling n multiplies the time by ever closer to 4"
    assert growth[-1] < 4


@pytest.mark.parametrize(("heavy", "light"), [(1, 1), (2, 1), (3, 1), (3, 2), (5, 4)])
@pytest.mark.parametrize("agents", [1, 10, 60])
def test_one_more_agent_unites_two_clusters_up_to_the_stable_distance(
    heavy: int, light: int, agents: int
) -> None:
    """V. D. Blondel, J. M. Hendrickx, J. N. Tsitsiklis, "On Krause's multi-agent consensus model with
    state-dependent connectivity", IEEE Trans. Automat. Control 54 (2009) 2586, arXiv:0807.2028.

    Two clusters stay apart despite a light agent between them if they are more than
    (1 + min(W_A, W_B) / max(W_A, W_B)) rho apart, and unite if they are closer. The agent moves to the center
    of mass. At the limiting distance the lighter cluster is exactly rho away from it, which is in range here.
    """
    rho, stable = heavy, heavy + light  # integers in the ratio 1 : 1 + light / heavy
    left, right = agents * heavy, agents * light

    def clusters_at_the_end(distance: float) -> list[int]:
        center = distance * right / (left + right)
        scenario = LineScenario(num_agents=left + right + 1, predator_position=None, max_steps=20_000)
        states = np.repeat([0.0, center, distance], [left, 1, right])
        run = simulate_line(scenario, rho, initial_state=states)
        assert run.converged
        return cluster_sizes(run)

    assert clusters_at_the_end(stable) == [left + right + 1]
    apart = [left, 1, right] if heavy == light else [left + 1, right]
    assert clusters_at_the_end(stable * (1 + 2**-40)) == apart


@pytest.mark.parametrize("seed", range(20))
def test_the_energy_falls_by_four_times_the_squared_moves(seed: int) -> None:
    """A. Bhattacharyya, M. Braverman, B. Chazelle, H. L. Nguyen, "On the convergence of the Hegselmann-Krause
    system", ITCS 2013, arXiv:1211.1909: E = sum over ordered pairs of min(|x_i - x_j|, rho)^2 falls in every
    step by at least 4 sum_i (x_i(t+1) - x_i(t))^2.

    With u the moves and A the graph, loops included, the left side is at least
    2 u' (Delta + A) u = 2 sum over edges (u_i + u_j)^2 + 4 u' u.
    """
    rng = np.random.default_rng(seed)
    lattice, rho = int(rng.integers(2, 40)), Fraction(int(rng.integers(1, 12)))
    run = exact_run([Fraction(int(x)) for x in rng.integers(0, lattice, 12)], rho)
    assert_is(fast_run(run[0], float(rho)), run)

    def energy(states: States) -> Fraction:
        return sum((min(abs(x - y), rho) ** 2 for x in states for y in states), Fraction(0))

    for before, after in pairwise(run):
        moves = sum(((y - x) ** 2 for x, y in zip(before, after, strict=True)), Fraction(0))
        assert energy(before) - energy(after) >= 4 * moves
        order = [y for _, y in sorted(zip(before, after, strict=True))]
        assert order == sorted(after), "agents never overtake (Krause)"


def test_uniform_opinions_agree_above_a_fifth() -> None:
    """S. Fortunato, "On the consensus threshold for the opinion dynamics of Krause-Hegselmann", Int. J. Mod.
    Phys. C 16 (2005) 259, arXiv:cond-mat/0408648: on a complete graph, many uniform opinions
    reach consensus if the range is above about 0.2 of the interval, and never below.
    """
    scenario = LineScenario(num_agents=2000, predator_position=None, max_steps=20_000)

    def clusters(rho: float) -> set[int]:
        return {int(simulate_line(scenario, rho, seed=seed).num_components[-1]) for seed in range(20)}

    assert clusters(0.25) == {1}
    assert 1 not in clusters(0.17)
