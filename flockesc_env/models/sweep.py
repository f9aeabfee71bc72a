"""``sweep``: grid search over fixed interaction ranges, on the same initial states for every range."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import FloatArray, as_choice, as_seeds, as_threads, as_vector
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import data_frame, figure_style
from flockesc_env.common.progress import Progress, reporting
from flockesc_env.models.simulate import Displayed, IntArray
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.objectives import ObjectiveSpec
from flockesc_env.scenario.presets import as_model

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class FlockOutcomes:
    """Base class of results of runs of flocks: their seeds and every objective.

    Attributes:
        seeds: the seeds, shape (seeds,).
        min_mean_distance: J_mean, the minimum over time of the mean predator distance, in m (Eq. 12).
        min_min_distance: J_min, the minimum over time of the minimum predator distance, in m (Eq. 13).
        fraction_surviving: share of agents that are not caught at the end.
    """

    seeds: NDArray[np.uint64]
    min_mean_distance: FloatArray
    min_min_distance: FloatArray
    fraction_surviving: FloatArray


@dataclass(frozen=True, eq=False, repr=False)
class SweepResult(Displayed):
    """Results of ``sweep`` for either model; arrays have shape (ranges, seeds) unless stated otherwise.

    Methods take the name of an objective, a key of ``scenario.objectives``; ``None``: the first one. Best
    ranges, intervals and figures raise ``InputError`` for a scenario without a predator, whose distances are
    infinite, and intervals for a single seed. Tables, figures and intervals need the extra ``analysis``.

    Attributes:
        scenario: the model's parameters.
        interaction_ranges: the ranges, shape (ranges,).
        seeds: the seeds, shape (seeds,).
        num_components: number of connected components at the end of each run.
    """

    scenario: FlockScenario | LineScenario
    interaction_ranges: FloatArray
    seeds: NDArray[np.uint64]
    num_components: IntArray

    def values(self, objective: str | None = None) -> FloatArray:
        """Return the objective of every run, shape (ranges, seeds)."""
        return self._spec(objective).values(self)

    def _spec(self, objective: str | None) -> ObjectiveSpec:
        if objective is None:
            return next(iter(self.scenario.objectives.values()))
        return self.scenario.objectives[as_choice(objective, "objective", self.scenario.objectives)]

    def best_range(self, objective: str | None = None) -> float:
        """Return the best fixed range: the range with the largest mean over seeds; if tied, the smallest one.

        Few seeds or a short grid leave it open: see ``best_range_with_interval``.
        """
        return float(self.interaction_ranges[np.argmax(self._finite(objective).mean(axis=1))])

    def _finite(self, objective: str | None) -> FloatArray:
        values = self.values(objective)
        if not np.isfinite(values).all():
            raise InputError("scenario", "a scenario with a predator", "no predators")
        return values

    def best_range_with_interval(self, objective: str | None = None) -> tuple[float, float, float]:
        """Return the best fixed range and the ends of its 95 % interval, a percentile bootstrap over seeds.

        An end at the largest range of the grid means that longer ranges may be better.
        """
        from flockesc_env.common.stats import argmax  # optional and slow to import

        found = argmax(self.interaction_ranges, self._finite(objective))
        return found.mean, found.low, found.high

    def hindsight_oracle(self, objective: str | None = None) -> FloatArray:
        """Return the objective under the best range of each seed, shape (seeds,).

        Its mean is an upper bound for every fixed range.
        """
        best: FloatArray = self.values(objective).max(axis=0)
        return best

    def mean_with_interval(self, objective: str | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the mean over seeds and the ends of its 95 % interval (Student's t), shape (ranges,).

        The interval is exact for values with a normal distribution, at any number of seeds. With fewer than
        10 seeds it contains the true mean less often if their distribution is skewed.
        """
        from flockesc_env.common.stats import mean_with_interval  # optional and slow to import

        return mean_with_interval(self._finite(objective))

    @figure_style()
    def plot(self, objective: str | None = None) -> Figure:
        """Return a Matplotlib figure of the objective against the range, as Figures 9 and 10 of the paper.

        It shows 95 % intervals, except with one seed. ``figure.savefig("curve.png")`` writes it.
        """
        from matplotlib.figure import Figure  # optional and slow to import

        best = self.best_range(objective)
        unit = self.scenario.range_unit
        found = f"best fixed range: {best:.4g} {unit}".rstrip()
        figure = Figure(figsize=(5.5, 3.5), layout="constrained")
        axes = figure.subplots()
        if len(self.seeds) > 1:
            _, low, high = self.mean_with_interval(objective)
            axes.fill_between(self.interaction_ranges, low, high, color="0.88", lw=0)
            _, shortest, longest = self.best_range_with_interval(objective)
            found += f" [{shortest:.4g}, {longest:.4g}]"
        axes.plot(self.interaction_ranges, self.values(objective).mean(axis=1), color="0.25", lw=2)
        axes.axvline(best, color="0.25", ls="--", lw=1)
        axes.set_xlabel(f"interaction range ({unit})" if unit else "interaction range")
        spec = self._spec(objective)
        axes.set_ylabel(spec.with_unit(spec.symbol))
        axes.set_title(f"{found}; seeds: {len(self.seeds):,}", loc="left", fontsize="medium")
        axes.margins(x=0)
        figure.draw_without_rendering()  # creates the labels of ticks in this style
        return figure

    def table(self) -> pl.DataFrame:
        """Return a polars DataFrame with one row per run: range, seed and outcomes."""
        columns = [*(spec.name for spec in self.scenario.objectives.values()), "num_components"]
        if isinstance(self, LineSweepResult):
            columns.append("converged")
        return data_frame(
            {
                "interaction_range": np.repeat(self.interaction_ranges, len(self.seeds)),
                "seed": np.tile(self.seeds, len(self.interaction_ranges)),
                **{name: getattr(self, name).ravel() for name in columns},
            }
        )


@dataclass(frozen=True, eq=False, repr=False)
class FlockSweepResult(FlockOutcomes, SweepResult):
    """Results of ``sweep`` for flocks.

    Inherits the attributes of ``SweepResult`` and ``FlockOutcomes``; arrays of shape (ranges, seeds).
    """


@dataclass(frozen=True, eq=False, repr=False)
class LineSweepResult(SweepResult):
    """Results of ``sweep`` for lines; arrays of shape (ranges, seeds).

    Attributes:
        escape_distance: escape distance d_ss in the steady state, or after ``max_steps`` steps if
            ``converged`` is False.
        converged: whether the line reached its steady state.
    """

    escape_distance: FloatArray
    converged: NDArray[np.bool]


RESULTS: Final[dict[str, type[FlockSweepResult | LineSweepResult]]] = {
    "flock": FlockSweepResult,
    "line": LineSweepResult,
}
"""Classes of results by model."""


@overload
def sweep(
    scenario: FlockScenario,
    interaction_ranges: ArrayLike,
    seeds: Iterable[int],
    *,
    num_threads: int | None = None,
    progress: Progress | bool | None = None,
) -> FlockSweepResult: ...
@overload
def sweep(
    scenario: LineScenario,
    interaction_ranges: ArrayLike,
    seeds: Iterable[int],
    *,
    num_threads: int | None = None,
    progress: Progress | bool | None = None,
) -> LineSweepResult: ...
@overload
def sweep(scenario: str, *arguments: Any, **options: Any) -> Any: ...  # the type depends on the preset
def sweep(
    scenario: FlockScenario | LineScenario | str,
    interaction_ranges: ArrayLike,
    seeds: Iterable[int],
    *,
    num_threads: int | None = None,
    progress: Progress | bool | None = None,
) -> FlockSweepResult | LineSweepResult:
    """Run the model with every range on the initial state of every seed.

    Args:
        scenario: the model's parameters, or a preset's name; its class decides which model runs.
        interaction_ranges: the ranges, shape (ranges,), in m for a flock.
        seeds: seeds of the initial states. ``simulate(seed=k)`` and ``env.reset(seed=k)`` start from the same
            state.
        num_threads: number of threads; ``None``: one per core. Results do not depend on it.
        progress: ``True``: show a progress bar on stderr. A function: called with (finished runs, all runs)
            about twenty times per second; an exception that it raises stops the sweep.

    Examples:
        >>> result = sweep("paper-flock", [0, 10, 100], seeds=range(10))
        >>> result.best_range()
        10.0
        >>> result.values("min_min_distance").shape
        (3, 10)
    """
    model = as_model(scenario)
    ranges = as_vector(interaction_ranges, "interaction_ranges", least=0.0)
    checked = np.array(as_seeds(seeds), np.uint64)
    threads, total, document = as_threads(num_threads), ranges.size * checked.size, model.to_json()
    with reporting(progress, "Sweep", total) as callback:
        report = None if callback is None else lambda done: callback(done, total)
        found = _core.sweep(model.model, document, ranges, checked, threads, report)
        return RESULTS[model.model](model, ranges, checked, **found)
