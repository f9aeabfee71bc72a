"""``scan``: measures of a flock against numbers of its scenario or its range, for several seeds."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env.common import checks
from flockesc_env.common.checks import FloatArray, as_choice, as_count, as_floats
from flockesc_env.common.errors import InputError, shown
from flockesc_env.common.extras import data_frame, figure_style
from flockesc_env.common.progress import Progress, reporting
from flockesc_env.models.order import MEASURES, Measure, autocorrelation_time, binder_cumulant, over_time
from flockesc_env.models.simulate import Displayed, run_flock
from flockesc_env.scenario.document import check_not_drawn, field_at
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

_RANGE = "interaction_range"
_RECORDED = ("polarization", "num_components", "mean_distance", "min_distance", "fraction_surviving")
NAMES: Final = tuple(dict.fromkeys((*_RECORDED, *MEASURES)))
"""Names of measures: columns of a ``Trajectory``, and measures of order."""
_NO_ORDER = set(NAMES) - {"polarization", "rotation"}


@dataclass(frozen=True, eq=False, repr=False)
class ScanResult(Displayed):
    """Results of ``scan``; T is the number of times that count.

    Methods take the name of a measure; ``None``: the first one. Statistics, tables and figures raise
    ``MissingExtraError`` without the ``analysis`` extra.

    Attributes:
        scenario: the scenario whose fields change.
        values: what changes, by name: fields and ``interaction_range``, each of shape (values,).
        seeds: the seeds, shape (seeds,).
        steps: the times that count, in steps, shape (T,).
        series: measures at these times by name, each of shape (values, seeds, T).
    """

    scenario: FlockScenario
    values: dict[str, FloatArray]
    seeds: NDArray[np.uint64]
    steps: NDArray[np.int64]
    series: dict[str, FloatArray]

    def _name(self, measure: str | None) -> str:
        name: str = next(iter(self.series)) if measure is None else as_choice(measure, "measure", self.series)
        return name

    def means(self, measure: str | None = None) -> FloatArray:
        """Return the mean over time of every run, shape (values, seeds)."""
        mean: FloatArray = self.series[self._name(measure)].mean(axis=-1)
        return mean

    def summary(self, measure: str | None = None) -> dict[str, FloatArray]:
        """Return statistics of a measure v by name, each of shape (values,); NaN where one is not defined.

        - ``mean``: mean of v over times and seeds; ``low``, ``high``: ends of its 95 % interval, Student's t
          over seeds.
        - ``susceptibility``: n (<v^2> - <v>^2), where means run over times and seeds; ``binder_cumulant``:
          see ``models.binder_cumulant``. They are defined for polarization, rotation and your own functions.
        - ``autocorrelation_time`` in steps: see ``models.autocorrelation_time``.
        """
        from flockesc_env.common.stats import mean_with_interval  # optional and slow to import

        name = self._name(measure)
        series, means, is_order = self.series[name], self.means(name), name not in _NO_ORDER
        undefined, every = np.full(len(means), np.nan), int(np.diff(self.steps[:2]).sum()) or 1
        low, high = mean_with_interval(means)[1:] if len(self.seeds) > 1 else (undefined, undefined)
        agents = self.values.get("num_agents", self.scenario.num_agents)
        return {
            "mean": means.mean(axis=1),
            "low": low,
            "high": high,
            "susceptibility": agents * series.var(axis=(1, 2)) if is_order else undefined,
            "binder_cumulant": np.array([*map(binder_cumulant, series)]) if is_order else undefined,
            "autocorrelation_time": every * np.array([*map(autocorrelation_time, series)]),
        }

    def notes(self, measure: str | None = None) -> list[str]:
        """Return a note for every value whose runs are shorter than ten autocorrelation times."""
        found, length = [], self.steps[-1] - self.steps[0] + 1
        for index, time in enumerate(self.summary(measure)["autocorrelation_time"]):
            if length < 10 * time:
                at = ", ".join(f"{name}={values[index]:g}" for name, values in self.values.items())
                found.append(f"{self._name(measure)} at {at}: {length} steps for a time of {time:.0f}")
        return found

    def table(self) -> pl.DataFrame:
        """Return a polars DataFrame with one row per run: values, seed and the mean of every measure."""
        repeated = {name: np.repeat(values, len(self.seeds)) for name, values in self.values.items()}
        means = {name: self.means(name).ravel() for name in self.series}
        return data_frame({**repeated, "seed": np.tile(self.seeds, len(self.values[_RANGE])), **means})

    @figure_style()
    def plot(self, measure: str | None = None, *, by: str | None = None) -> Figure:
        """Return a Matplotlib figure of the means of a measure, with 95 % intervals if there are two seeds.

        The first of ``values`` is the horizontal axis. ``by`` names the field with a curve per number
        (``None``: one curve). ``figure.savefig("order.png")`` writes it.
        """
        from matplotlib.figure import Figure  # optional and slow to import

        name, (mean, low, high, *_) = self._name(measure), self.summary(measure).values()
        axis, x = next(iter(self.values.items()))
        curves = np.zeros(len(x)) if by is None else self.values[as_choice(by, "by", self.values)]
        figure = Figure(figsize=(5.5, 3.5), layout="constrained")
        axes = figure.subplots()
        for curve in np.unique(curves):
            at = np.flatnonzero(curves == curve)
            at = at[np.argsort(x[at], kind="stable")]
            errors = (mean[at] - low[at], high[at] - mean[at])
            axes.errorbar(x[at], mean[at], errors, fmt=".-", capsize=2, label=f"{by}: {curve:g}")
        if by is not None:
            axes.legend(fontsize="small")
        axes.set(xlabel=axis, ylabel=name)
        short = "; some runs shorter than ten autocorrelation times" if self.notes(name) else ""
        axes.set_title(f"seeds: {len(self.seeds):,}{short}", loc="left", fontsize="medium")
        if name in {"polarization", "rotation"}:
            axes.set_ylim(0, 1)
        figure.draw_without_rendering()  # creates the labels of ticks in this style
        return figure


def scan(
    scenario: FlockScenario | str,
    values: Mapping[str, ArrayLike],
    interaction_range: ArrayLike,
    seeds: Iterable[int],
    *,
    measures: Sequence[str | Callable[[FloatArray, FloatArray], float]] = ("polarization",),
    skip: int = 0,
    every: int = 1,
    num_threads: int | None = None,
    progress: Progress | bool | None = None,
) -> ScanResult:
    """Run a flock with several values of its fields or its range on every seed, and measure it over time.

    Each thread stores one run: its measures, and positions and velocities only for measures that need them.

    Args:
        scenario: the flock model's parameters, or a preset's name.
        values: values of one field, or of several that change together, by name, each of shape (values,):
            ``{"num_agents": [100, 400], "initial_side": [50.0, 100.0]}``. Names may be dotted paths, such as
            ``"motion.cohesion_strength"``, to numbers that ``randomization`` does not draw.
        interaction_range: rho in the unit of the neighbor rule, a number or one per value, shape (values,).
        seeds: seeds of the flocks. ``simulate(seed=k)`` plays the same flock.
        measures: names of measures of order (``polarization``, ``rotation``, ``nearest_neighbor_distance``,
            ``density``, ``correlation_length``) or of columns of ``Trajectory`` (such as ``num_components``),
            and functions of the positions in m and velocities in m/s of the agents that are not caught, each
            of shape (n, D), that return a finite number.
        skip: number of steps before the first time that counts, at most ``scenario.num_steps``.
        every: number of steps between times that count; they are multiples of it.
        num_threads: see ``sweep``. Your functions are called in several threads.
        progress: see ``sweep``.

    Examples:
        >>> result = scan("vicsek", {"angular_noise": [0.0, 3.0, 6.0]}, 10.0, seeds=range(5), skip=50)
        >>> result.means().shape
        (3, 5)
    """
    model, known = as_scenario(scenario, FlockScenario), _known(measures)
    if not isinstance(values, Mapping):
        raise InputError("values", "a dict of fields and their values", shown(values))
    given = {checks.as_text(name, "values"): checks.as_vector(each, name) for name, each in values.items()}
    if taken := given.keys() & {"num_steps", *known}:
        raise InputError("values", "no num_steps, on which shapes depend, and no measure", min(taken))
    check_not_drawn(model, given)
    rho = as_floats(interaction_range, _RANGE, least=0.0)
    count = len(next(iter(given.values()), np.atleast_1d(rho)))
    given[_RANGE] = np.full(count, rho) if rho.ndim == 0 else rho
    for name, each in given.items():
        if each.shape != (count,):
            raise InputError(name, f"shape ({count},)", f"shape {each.shape}")
    models = [_changed(model, {name: given[name][index] for name in values}) for index in range(count)]
    numbers = np.array(checks.as_seeds(seeds), np.uint64)
    first = as_count(skip, "skip", least=0, most=model.num_steps)
    stride = as_count(every, "every", most=max(1, model.num_steps - first))
    steps = np.arange(-(-first // stride) * stride, model.num_steps + 1, stride)
    threads, total = checks.as_threads(num_threads), count * numbers.size
    with reporting(progress, "Scan", total) as callback:
        found, stop = np.empty((total, len(known), len(steps))), Event()

        def measured(cell: int) -> FloatArray:
            value, seed = divmod(cell, numbers.size)
            run: Any = {"every": stride, "seed": int(numbers[seed]), "num_threads": 1, "stop": stop}
            return _measured(models[value], given[_RANGE][value], run, steps // stride, known)

        with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
            try:
                for index, run in enumerate(pool.map(measured, range(total))):
                    found[index] = run
                    if callback is not None:
                        callback(index + 1, total)
            finally:  # an error or Ctrl-C stops the other runs
                stop.set()
                pool.shutdown(cancel_futures=True)
    shaped = np.moveaxis(found.reshape(count, numbers.size, len(known), len(steps)), 2, 0).copy()
    return ScanResult(model, given, numbers, steps, dict(zip(known, shaped, strict=True)))


def _changed(scenario: FlockScenario, values: Mapping[str, float]) -> FlockScenario:
    """Return a scenario with other numbers at dotted paths."""
    document = json.loads(scenario.to_json())
    for path, value in values.items():
        parent, key = field_at(document, path, "values")
        parent[key] = int(value) if isinstance(parent[key], int) and value.is_integer() else float(value)
    return FlockScenario.from_json(json.dumps(document))


def _known(measures: Any) -> dict[str, Measure | None]:
    """Return measures of tracks by name; ``None``: a column of every run."""
    if isinstance(measures, str) or not isinstance(measures, Sequence) or not measures:
        raise InputError("measures", "a list of names and functions", shown(measures))
    found: dict[str, Measure | None] = {}
    for each in measures:
        name = getattr(each, "__name__", repr(each)) if callable(each) else as_choice(each, "measures", NAMES)
        if name in found:
            raise InputError("measures", "different names", f"two {name}")
        found[name] = _own(each, name) if callable(each) else None if name in _RECORDED else MEASURES[name]
    return found


def _own(function: Callable[..., Any], name: str) -> Measure:
    return over_time(lambda r, v, _: float(as_floats(function(r, v), f"measures[{name}]", ())))


def _measured(
    scenario: FlockScenario,
    interaction_range: float,
    arguments: Mapping[str, Any],
    rows: NDArray[np.int64],
    measures: Mapping[str, Measure | None],
) -> FloatArray:
    """Return the measures of a run at some of its recorded times, shape (measures, T)."""
    record = [name for name, measure in measures.items() if measure is None]
    if has_agents := len(record) < len(measures):
        record += ["positions", "velocities"]
    run = run_flock(scenario, interaction_range, record=record, **arguments)
    found = np.empty((len(measures), len(rows)))
    if has_agents:
        positions = np.where(run.is_caught[..., np.newaxis], np.nan, run.positions)[rows]
        tracks: Any = positions, run.velocities[rows]
    for row, (name, measure) in zip(found, measures.items(), strict=True):
        each = measure(*tracks, side=run.scenario.periodic_side) if measure else getattr(run, name)[rows]
        row[:] = as_floats(each, f"measures[{name}]")
    return found
