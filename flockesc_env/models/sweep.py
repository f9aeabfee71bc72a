"""Grid search over fixed ranges: every range on the same initial states."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import (
    FloatArray,
    as_callback,
    as_choice,
    as_floats,
    as_path,
    as_seeds,
    as_threads,
)
from flockesc_env.common.errors import ArgumentError
from flockesc_env.common.extras import require
from flockesc_env.common.files import atomic_write
from flockesc_env.models.simulate import IntArray
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.line import LineScenario
from flockesc_env.scenario.presets import as_model

if TYPE_CHECKING:
    import polars as pl

Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class SweepResult:
    """Outcomes of a grid search: arrays of shape (ranges, seeds).

    Attributes:
        scenario: the model's parameters.
        interaction_ranges: shape (ranges,).
        seeds: shape (seeds,).
        num_components: connected components at the end.
    """

    scenario: FlockScenario | LineScenario
    interaction_ranges: FloatArray
    seeds: NDArray[np.uint64]
    num_components: IntArray

    objectives: ClassVar[dict[str, str]]
    """Which attribute holds the values of which objective; the first is the default."""

    def values(self, objective: str | None = None) -> FloatArray:
        """Return the objective of every run, shape (ranges, seeds).

        Raises:
            ArgumentError: if this model has no such objective.
        """
        if objective is None:
            objective = next(iter(self.objectives))
        as_choice(objective, "objective", self.objectives)
        values: FloatArray = getattr(self, self.objectives[objective])
        return values

    def best_range(self, objective: str | None = None) -> float:
        """Return the range with the largest mean over seeds; the smallest one among equals.

        Raises:
            ArgumentError: if there was no predator, so that no range is better than another.
        """
        mean = self.values(objective).mean(axis=1)
        if not np.isfinite(mean).all():
            raise ArgumentError("scenario", "a predator to escape from", "none")
        return float(self.interaction_ranges[np.argmax(mean)])

    def hindsight_oracle(self, objective: str | None = None) -> FloatArray:
        """Return what the best range of each seed reaches, shape (seeds,): no fixed range can do better."""
        best: FloatArray = self.values(objective).max(axis=0)
        return best

    def mean_with_interval(
        self, objective: str | None = None, *, confidence: float = 0.95
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return mean over seeds and its percentile bootstrap interval, three arrays of shape (ranges,).

        Needs the ``analysis`` extra.

        Raises:
            ArgumentError: for a single seed, or a confidence that is not between 0 and 1.
        """
        require("analysis", ["scipy"])
        from scipy.stats import bootstrap  # heavy and optional: not imported with the package

        values = self.values(objective)
        if len(self.seeds) < 2:
            raise ArgumentError("seeds", "at least 2 for an interval", len(self.seeds))
        level = float(as_floats(confidence, "confidence", ()))
        if not 0 < level < 1:
            raise ArgumentError("confidence", "a number between 0 and 1", level)
        band = bootstrap(
            (values,),
            np.mean,
            axis=1,
            confidence_level=level,
            method="percentile",
            n_resamples=2000,
            batch=50,
            rng=np.random.default_rng(0),
        ).confidence_interval
        return values.mean(axis=1), band.low, band.high

    def table(self) -> pl.DataFrame:
        """Return one row per run: range, seed, outcomes. Needs the ``analysis`` extra."""
        require("analysis", ["polars"])
        import polars as pl

        columns = [*self.objectives.values(), "num_components"]
        if isinstance(self, LineSweepResult):
            columns.append("converged")
        return pl.DataFrame(
            {
                "interaction_range": np.repeat(self.interaction_ranges, len(self.seeds)),
                "seed": np.tile(self.seeds, len(self.interaction_ranges)),
                **{name: getattr(self, name).ravel() for name in columns},
            }
        )

    def to_parquet(self, path: str | Path) -> None:
        """Write the table, with the scenario in the file's metadata. Needs the ``analysis`` extra.

        An older file of that name stays whole until the new one is complete.
        """
        path = as_path(path)
        table = self.table()
        with atomic_write(path) as file:
            table.write_parquet(file, metadata={"scenario": self.scenario.to_json()})


@dataclass(frozen=True, eq=False)
class FlockSweepResult(SweepResult):
    """Outcomes of a grid search over flocks: arrays of shape (ranges, seeds).

    Attributes:
        min_mean_distance: J_mean = min over t of the mean distance, in m (Eq. 12).
        min_min_distance: J_min = min over t of the minimum distance, in m (Eq. 13).
        fraction_surviving: share of the agents that were not caught by the horizon.
    """

    min_mean_distance: FloatArray
    min_min_distance: FloatArray
    fraction_surviving: FloatArray

    objectives: ClassVar[dict[str, str]] = {
        "mean": "min_mean_distance",
        "minimum": "min_min_distance",
        "survival": "fraction_surviving",
    }


@dataclass(frozen=True, eq=False)
class LineSweepResult(SweepResult):
    """Outcomes of a grid search over lines: arrays of shape (ranges, seeds).

    Attributes:
        escape_distance: d_ss; where ``converged`` is false, the escape distance after ``max_steps``.
        converged: whether a steady state was reached.
    """

    escape_distance: FloatArray
    converged: NDArray[np.bool]

    objectives: ClassVar[dict[str, str]] = {"escape_distance": "escape_distance"}


@overload
def sweep(
    scenario: FlockScenario,
    interaction_ranges: ArrayLike,
    seeds: Iterable[int],
    *,
    num_threads: int | None = None,
    progress: Progress | None = None,
) -> FlockSweepResult: ...
@overload
def sweep(
    scenario: LineScenario,
    interaction_ranges: ArrayLike,
    seeds: Iterable[int],
    *,
    num_threads: int | None = None,
    progress: Progress | None = None,
) -> LineSweepResult: ...
@overload
def sweep(
    scenario: str,
    interaction_ranges: ArrayLike,
    seeds: Iterable[int],
    *,
    num_threads: int | None = None,
    progress: Progress | None = None,
) -> Any: ...  # the model is known once the name is looked up
def sweep(
    scenario: FlockScenario | LineScenario | str,
    interaction_ranges: ArrayLike,
    seeds: Iterable[int],
    *,
    num_threads: int | None = None,
    progress: Progress | None = None,
) -> FlockSweepResult | LineSweepResult:
    """Run every range on the initial state of every seed.

    Args:
        scenario: the model's parameters, or a preset's name; its class decides which model runs.
        interaction_ranges: shape (ranges,), in m for the flock.
        seeds: seed k is the initial state of ``simulate(seed=k)`` and ``env.reset(seed=k)``.
        num_threads: threads to use; ``None``: one per core. The results do not depend on it.
        progress: called with (finished runs, all runs) about twenty times a second; an exception that it
            raises stops the sweep.

    Raises:
        ArgumentError: naming the argument of a wrong type or shape, negative or not finite.
        ScenarioError: if no preset has the name.
    """
    model = as_model(scenario)
    ranges = as_floats(interaction_ranges, "interaction_ranges", least=0.0)
    if ranges.ndim != 1 or not ranges.size:
        raise ArgumentError("interaction_ranges", "shape (k,) with k >= 1", f"shape {ranges.shape}")
    checked = np.array(as_seeds(seeds), np.uint64)
    threads, progress = as_threads(num_threads), as_callback(progress)
    total = ranges.size * checked.size
    report = None if progress is None else lambda done: progress(done, total)
    document = model.to_json()
    if isinstance(model, FlockScenario):
        flocks = _core.sweep_flock(document, ranges, checked, threads, report)
        return FlockSweepResult(model, ranges, checked, **flocks)
    lines = _core.sweep_line(document, ranges, checked, threads, report)
    return LineSweepResult(model, ranges, checked, **lines)
