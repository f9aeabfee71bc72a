"""Figures of an independent simulation of the model, matched within three standard errors."""

import numpy as np
import pytest

import flockesc_env as fe
from flockesc_env.models import FlockSweepResult, LineSweepResult

LINE_BATCH = 40
LINE_GRID = np.arange(11) / 10

# rho: (J_mean, standard error, J_min, standard error, components at 12 s, half of their last digit)
FIGURES = {
    0.0: (69.26, 0.16, 5.92, 0.27, 300, 0.5),
    5.0: (71.42, 0.61, 9.91, 0.55, 38.4, 0.05),
    10.0: (71.76, 0.92, 11.29, 0.60, 11.7, 0.05),
    15.0: (73.43, 1.09, 11.43, 0.61, 5.4, 0.05),
    20.0: (71.04, 1.29, 10.44, 0.62, 2.7, 0.05),
    30.0: (70.44, 1.27, 11.67, 0.79, 1.6, 0.05),
    50.0: (68.40, 1.28, 13.18, 0.92, 1.1, 0.05),
    100.0: (68.48, 1.22, 11.81, 0.95, 1, 0.5),
}
FLOCKS, LINES = 100, 400  # initial states of the other simulation


def assert_close(values: np.ndarray, figure: float, error: float, half_digit: float = 0.0) -> None:
    """Compare the mean of ``values`` with a figure with a given standard error."""
    own = values.std(ddof=1) / np.sqrt(len(values))
    assert abs(values.mean() - figure) <= 3 * np.hypot(error, own) + half_digit


def assert_close_to_mean_of(values: np.ndarray, figure: float, states: int, half_digit: float) -> None:
    """Compare with a printed mean over ``states`` states, assuming the standard deviation of ``values``."""
    assert_close(values, figure, values.std(ddof=1) / np.sqrt(states), half_digit)


@pytest.fixture(scope="module")
def flocks() -> FlockSweepResult:
    result = fe.sweep(fe.FlockScenario(), list(FIGURES), range(250))
    assert isinstance(result, FlockSweepResult)
    return result


def lines(force: str, grid: np.ndarray | list[float] = LINE_GRID) -> LineSweepResult:
    result = fe.sweep(fe.LineScenario(escape_force=force), grid, range(10 * LINE_BATCH))
    assert isinstance(result, LineSweepResult)
    return result


@pytest.mark.parametrize("rho", FIGURES)
def test_flock_table(flocks: FlockSweepResult, rho: float) -> None:
    row = list(FIGURES).index(rho)
    mean, mean_error, minimum, minimum_error, components, half_digit = FIGURES[rho]
    assert_close(flocks.min_mean_distance[row], mean, mean_error)
    assert_close(flocks.min_min_distance[row], minimum, minimum_error)
    assert_close_to_mean_of(flocks.num_components[row], components, FLOCKS, half_digit)


def test_best_fixed_range_of_the_mean_distance_is_in_the_interior(flocks: FlockSweepResult) -> None:
    assert 5 <= flocks.best_range("min_mean_distance") <= 20
    # No fixed range is best for every flock: a policy can gain up to the oracle's lead.
    lead = (
        flocks.hindsight_oracle("min_mean_distance") - flocks.values("min_mean_distance").mean(axis=1).max()
    )
    assert lead.mean() > 3 * lead.std(ddof=1) / np.sqrt(len(lead))


def test_the_literal_law_falls_apart() -> None:
    """Without constant speed almost all agents separate: about 296 components instead of 12."""
    result = fe.sweep(fe.FlockScenario(constant_speed=False), [10.0], range(50))
    assert_close_to_mean_of(result.num_components[0], 296, FLOCKS, 0.5)


@pytest.mark.parametrize(
    ("force", "distance", "components"), [("linear", 0.292, 2.55), ("linear_as_printed", 0.316, 2.44)]
)
def test_line(force: str, distance: float, components: float) -> None:
    result = lines(force)
    batches = result.escape_distance.reshape(len(LINE_GRID), -1, LINE_BATCH).mean(axis=2)
    optima, best = LINE_GRID[batches.argmax(axis=0)], result.best_range()
    if force == "linear":
        # About one batch of 40 in twenty has its maximum at the nearly equal second peak, near 0.7 here.
        assert set(optima) <= {0.1, 0.7}
        assert (optima == 0.1).mean() >= 0.8
        assert best == 0.1
        assert result.converged[1].all()
    else:
        assert min(*optima, best) >= 0.6
        assert not result.converged.all()  # some runs oscillate forever and never become steady
    assert_close_to_mean_of(result.escape_distance[1], distance, LINES, 0.0005)
    assert_close_to_mean_of(result.num_components[1], components, LINES, 0.005)


def test_second_peak_of_the_line() -> None:
    """The paper's coarse grid hides a local maximum that is nearly as good as 0.1."""
    result = lines("linear", [0.1, 0.54, 0.66, 0.78])
    first, left, second, right = result.escape_distance.mean(axis=1)
    assert first > second > max(left, right)
    assert_close_to_mean_of(result.escape_distance[2], 0.289, LINES, 0.0005)


def test_stubborn_leaders() -> None:
    episodes = fe.rollout("paper-flock", "stubborn-leaders", range(200))
    assert_close(episodes.min_mean_distance, 88.1, 0.5)
