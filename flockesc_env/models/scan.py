"""``scan``: the order parameter of a flock against one number of its scenario, for several seeds."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flockesc_env import _core
from flockesc_env.common.checks import (
    FloatArray,
    as_count,
    as_floats,
    as_seeds,
    as_text,
    as_threads,
    as_vector,
)
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import figure_style
from flockesc_env.common.progress import Progress, reporting
from flockesc_env.models.order import binder_cumulant
from flockesc_env.models.simulate import Displayed
from flockesc_env.scenario.document import check_not_drawn, field_at
from flockesc_env.scenario.flock import FlockScenario
from flockesc_env.scenario.presets import as_scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class ScanResult(Displayed):
    """Results of ``scan``. Figures and intervals raise ``MissingExtraError`` without the ``analysis`` extra.

    Attributes:
        scenario: the scenario whose field changes.
        field: name or dotted path of the field.
        values: values of the field, shape (values,).
        interaction_range: rho in m, or in the unit of the neighbor rule.
        seeds: the seeds, shape (seeds,).
        skip: number of steps before the first time that counts in means.
        polarization: norm of the mean heading at every time, shape (values, seeds, T + 1).
    """

    scenario: FlockScenario
    field: str
    values: FloatArray
    interaction_range: float
    seeds: NDArray[np.uint64]
    skip: int
    polarization: FloatArray

    def _summary(self) -> dict[str, object]:
        return {"field": self.field, "num_values": len(self.values), "num_seeds": len(self.seeds)}

    def order_parameter(self) -> FloatArray:
        """Return the mean over time of the polarization after ``skip`` steps, shape (values, seeds)."""
        mean: FloatArray = self.polarization[..., self.skip :].mean(axis=-1)
        return mean

    def mean_with_interval(self, *, confidence: float = 0.95) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the mean over seeds of the order parameter, and the ends of its t interval, shape (values,).

        See ``SweepResult.mean_with_interval``.
        """
        from flockesc_env.common.stats import mean_with_interval  # optional and slow to import

        return mean_with_interval(self.order_parameter(), confidence)

    def binder_cumulant(self) -> FloatArray:
        """Return the Binder cumulant of the polarization after ``skip`` steps, shape (values,).

        Its means run over times and seeds; see ``flockesc_env.models.binder_cumulant``.
        """
        return np.array([binder_cumulant(each) for each in self.polarization[..., self.skip :]])

    @figure_style()
    def plot(self) -> Figure:
        """Return a Matplotlib figure of the order parameter against the values.

        It shows the 95 % interval, except with one seed. ``figure.savefig("order.png")`` writes it.
        """
        from matplotlib.figure import Figure  # optional and slow to import

        figure = Figure(figsize=(5.5, 3.5), layout="constrained")
        axes = figure.subplots()
        mean = self.order_parameter().mean(axis=1)
        errors = None
        if len(self.seeds) > 1:
            _, low, high = self.mean_with_interval()
            errors = (mean - low, high - mean)
        axes.errorbar(self.values, mean, errors, fmt=".-", color="0.25", capsize=2)
        axes.set_xlabel(self.field)
        axes.set_ylabel("polarization")
        axes.set_title(f"seeds: {len(self.seeds):,}", loc="left", fontsize="medium")
        axes.set_ylim(0, 1)
        figure.draw_without_rendering()  # creates the labels of ticks in this style
        return figure


def scan(
    scenario: FlockScenario | str,
    field: str,
    values: ArrayLike,
    interaction_range: float,
    seeds: Iterable[int],
    *,
    skip: int = 0,
    num_threads: int | None = None,
    progress: Progress | bool | None = None,
) -> ScanResult:
    """Run a flock with every value of one field on every seed, and keep the polarization at every time.

    Positions are not stored, so large flocks and long runs fit into memory.

    Args:
        scenario: the flock model's parameters, or a preset's name.
        field: a number of the scenario, as a name or a dotted path, for example ``"angular_noise"`` or
            ``"motion.cohesion_strength"``; not one that ``randomization`` draws.
        values: values of the field, shape (values,).
        interaction_range: rho, in the unit of the neighbor rule.
        seeds: seeds of the flocks. ``simulate(seed=k)`` plays the same flock.
        skip: number of steps before the first time that counts in means, at most ``scenario.num_steps``.
        num_threads: see ``sweep``.
        progress: see ``sweep``.

    Examples:
        >>> result = scan("vicsek", "angular_noise", [0.0, 3.0, 6.0], 10.0, seeds=range(5), skip=50)
        >>> result.order_parameter().shape
        (3, 5)
    """
    model = as_scenario(scenario, FlockScenario)
    path = as_text(field, "field")
    if path == "num_steps":
        raise InputError("field", "a field other than num_steps, on which shapes depend", path)
    given = as_vector(values, "values")
    check_not_drawn(model, [path])
    scenario_document = json.loads(model.to_json())
    parent, key = field_at(scenario_document, path, "field")
    is_integer = isinstance(parent[key], int)
    documents = []
    for value in given.tolist():
        parent[key] = int(value) if is_integer and value.is_integer() else value
        documents.append(FlockScenario.from_json(json.dumps(scenario_document)).to_json())
    rho = float(as_floats(interaction_range, "interaction_range", (), least=0.0))
    checked = np.array(as_seeds(seeds), np.uint64)
    first = as_count(skip, "skip", least=0, most=model.num_steps)
    threads = as_threads(num_threads)
    total = given.size * checked.size
    with reporting(progress, "Scan", total) as callback:
        report = None if callback is None else lambda done: callback(done, total)
        runs = _core.scan_flock(documents, rho, checked, threads, report)
    polarization = runs.reshape(given.size, checked.size, model.num_steps + 1)
    return ScanResult(model, path, given, rho, checked, first, polarization)
