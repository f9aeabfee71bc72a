"""Results of a grid search: best range, hindsight oracle, intervals, tables, files and progress."""

import numpy as np
import polars as pl
import pytest
from objective_values import COLUMNS
from option_table import small_flock
from scipy.stats import binomtest, ttest_1samp

import flockesc_env as fe
from flockesc_env.common import stats
from flockesc_env.models import FlockSweepResult, LineSweepResult
from flockesc_env.scenario import PurePursuit

RANGES = [0.0, 5.0, 30.0]
SEEDS = [4, 2**64 - 1, 17, 3]


def result_of(values: np.ndarray) -> FlockSweepResult:
    """Return a sweep with the given values of J_mean; other objectives have the opposite ones."""
    ranges, seeds = values.shape
    return FlockSweepResult(
        scenario=fe.FlockScenario(),
        interaction_ranges=np.arange(ranges, dtype=np.float64),
        seeds=np.arange(seeds, dtype=np.uint64),
        num_components=np.ones(values.shape, np.int64),
        **dict.fromkeys(COLUMNS.values(), -values) | {"min_mean_distance": values},
    )


@pytest.fixture(scope="module")
def flocks() -> FlockSweepResult:
    result = fe.sweep(small_flock(num_agents=20, capture_radius=8.0), RANGES, SEEDS)
    assert isinstance(result, FlockSweepResult)
    return result


@pytest.fixture(scope="module")
def lines() -> LineSweepResult:
    scenario = fe.LineScenario(escape_force="linear_as_printed", max_steps=60)
    result = fe.sweep(scenario, [0.1, 0.4, 0.8], range(30))
    assert isinstance(result, LineSweepResult)
    return result


def test_best_range_and_hindsight_oracle() -> None:
    """The largest mean, of equal ones the first, and the largest value of each seed."""
    result = result_of(np.array([[1.0, 2.0], [4.0, 0.0], [0.0, 5.0], [5.0, 0.0]]))
    assert result.best_range() == result.best_range("min_mean_distance") == 2.0
    assert result.best_range("min_min_distance") == 0.0
    assert type(result.best_range()) is float
    np.testing.assert_array_equal(result.hindsight_oracle(), [5.0, 5.0])
    np.testing.assert_array_equal(result.hindsight_oracle("min_min_distance"), [0.0, 0.0])


@pytest.mark.parametrize("num_seeds", [3, 40])
def test_intervals_are_those_of_scipy(num_seeds: int) -> None:
    values = np.random.default_rng(num_seeds).normal(70, 8, (9, num_seeds))
    mean, low, high = result_of(values).mean_with_interval()
    np.testing.assert_array_equal(mean, values.mean(axis=1))
    expected = ttest_1samp(values, 0, axis=1).confidence_interval(0.95)
    np.testing.assert_allclose([low, high], expected, rtol=1e-12)
    ends = {(one.low, one.high) for one in (stats.mean(np.array([2.0])), stats.mean(np.full(num_seeds, 0.1)))}
    assert ends == {(-np.inf, np.inf), (np.full(num_seeds, 0.1).mean(),) * 2}
    wins = stats.improvement(np.ones(num_seeds), np.zeros(num_seeds))
    wilson = binomtest(num_seeds, num_seeds).proportion_ci(method="wilson")
    assert (wins.mean, wins.low, wins.high) == pytest.approx((1.0, wilson.low, wilson.high))


def test_the_interval_of_the_best_range_reaches_every_range_that_may_be_the_best() -> None:
    """Means rise to 20; then they fall, or stay equal."""
    noise, ranges = np.random.default_rng(0).normal(size=(50, 40)), np.arange(50)
    for means, is_open in ((20 - abs(ranges - 20), False), (np.minimum(ranges, 20), True)):
        result = result_of(means[:, np.newaxis] + noise)
        best, low, high = result.best_range_with_interval()
        assert best == result.best_range()
        assert 18 <= low <= best <= high
        assert (high > 40) == is_open


def test_table_has_a_row_per_run(flocks: FlockSweepResult, lines: LineSweepResult) -> None:
    table = flocks.table()
    outcomes = ["min_mean_distance", "min_min_distance", "fraction_surviving", "num_components"]
    assert table.columns == ["interaction_range", "seed", *outcomes]
    assert table.height == len(RANGES) * len(SEEDS)
    assert table["seed"].dtype == pl.UInt64
    for row in table.iter_rows(named=True):
        run = fe.simulate(flocks.scenario, row["interaction_range"], seed=row["seed"])
        assert row["min_mean_distance"] == run.mean_distance.min()
        assert row["min_min_distance"] == run.min_distance.min()
        assert row["fraction_surviving"] == run.fraction_surviving[-1]
        assert row["num_components"] == run.num_components[-1]
    outcomes = ["escape_distance", "num_components", "converged"]
    assert lines.table().columns == ["interaction_range", "seed", *outcomes]
    assert lines.table()["converged"].to_list() == lines.converged.ravel().tolist()


def test_a_plot_shows_the_means_and_the_best_range(flocks: FlockSweepResult, lines: LineSweepResult) -> None:
    for result, objective in ((flocks, None), (flocks, "fraction_surviving"), (lines, None)):
        (axes,) = result.plot(objective).axes
        curve, best = axes.lines
        np.testing.assert_array_equal(curve.get_xdata(), result.interaction_ranges)
        np.testing.assert_array_equal(curve.get_ydata(), result.values(objective).mean(axis=1))
        assert best.get_xdata()[0] == result.best_range(objective)
    with pytest.raises(fe.InputError, match="predator"):
        fe.sweep(small_flock(num_agents=9, predators=()), RANGES, SEEDS).plot()


def test_tables_of_runs_hold_the_runs() -> None:
    run = fe.simulate("capture", 10.0, seed=1)
    table, agents = run.table(), run.agents_table()
    assert table["mean_distance"].to_list() == run.mean_distance.tolist()
    assert agents.height == run.positions[..., 0].size
    last = agents.filter(pl.col("time") == run.times[-1])
    assert last.select("x", "y").to_numpy().tolist() == run.positions[-1].tolist()
    assert last.select("vx", "vy").to_numpy().tolist() == run.velocities[-1].tolist()
    assert last["is_caught"].to_list() == (run.caught_at >= 0).tolist()
    assert agents["is_caught"].sum() == (len(run.times) - run.caught_at[run.caught_at >= 0]).sum()
    predators, catches = run.predators_table(), run.catches_table()
    assert predators.filter(pl.col("time") == run.times[7]).rows() == [
        (run.times[7], 0, *run.predator_positions[7, 0])
    ]
    assert sorted(catches["agent"]) == np.flatnonzero(run.caught_at >= 0).tolist() != []
    assert catches["time"].is_sorted()
    assert catches["time"].to_list() == run.times[run.caught_at[catches["agent"]]].tolist()
    assert catches["distance"].max() <= run.scenario.capture_radius
    pair = run.scenario.replace(predators=(PurePursuit(), PurePursuit((130.0, 130.0), (-10.0, -10.0))))
    assert set(fe.simulate(pair, 10.0, seed=1).catches_table()["predator"]) == {0, 1}
    assert fe.simulate("order", 10.0, seed=1).catches_table().height == 0
    line = fe.simulate("paper-line", 0.1, seed=1)
    assert line.table()["x_3"].to_list() == line.states[:, 3].tolist()
    for scenario in ("capture", "paper-line"):
        episodes = fe.rollout(scenario, fe.FixedRange(0.1), [3, 1], action_mode="range")
        columns = {"seed" if name == "seeds" else name: value for name, value in vars(episodes).items()}
        assert episodes.table().to_pandas().to_dict("list") == {
            name: value.tolist() for name, value in columns.items()
        }
