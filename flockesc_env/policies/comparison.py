"""``Comparison``: the objectives of policies on the same flocks, as a table and a figure."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flockesc_env.common.array_files import origin, write_table
from flockesc_env.common.checks import FloatArray, as_path
from flockesc_env.common.errors import InputError
from flockesc_env.common.extras import data_frame, figure_style
from flockesc_env.common.files import write_text
from flockesc_env.episodes.batch import Columns
from flockesc_env.scenario.objectives import ObjectiveSpec
from flockesc_env.scenario.presets import Scenario

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

    from flockesc_env.common.stats import Estimate

LOADS: Final = ("mean_range", "mean_heard")
ORACLE: Final = "hindsight oracle over fixed ranges"


@dataclass(frozen=True)
class ComparisonRow:
    """What a policy reaches: its objective, and its paired differences.

    Attributes:
        objective: mean objective.
        difference: mean paired difference to the baseline, the first row.
        to_rule: mean paired difference to the task's rule; ``None`` without a task.
        improvement: share of flocks with a better objective than under the baseline; ties count half.
        mean_range: mean range, as in ``Episodes``; ``None`` for a line.
        mean_heard: mean number of agents that an agent heard in a step; ``None`` for a line.
    """

    objective: "Estimate"
    difference: "Estimate"
    to_rule: "Estimate | None"
    improvement: "Estimate"
    mean_range: float | None = None
    mean_heard: float | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """The objectives of policies on the same flocks; see ``compare``. Printing it is the table.

    Attributes:
        scenario: name of the scenario.
        spec: the objective.
        seeds: seeds of the flocks.
        range_unit: unit of ``mean_range``.
        played: columns by policy: ``objective`` of every flock and, not for lines, ``mean_range`` and
            ``mean_heard`` as in ``Episodes``. The baseline is first: the best fixed range, or the best
            built-in predator.
        flock_policy: name of the flock's policy if predators are compared; ``None`` otherwise.
        best_range: the best fixed range; this and the next two are ``None`` for predators.
        search: the grid search over fixed ranges on these flocks.
        tuning: the grid search that chose the best fixed range; ``None`` for a task, which knows it.
        task: name of the task; ``None`` without a task.
        rule: name of the task's rule, the best policy without training; ``None`` without a task.
    """

    scenario: str
    spec: ObjectiveSpec
    seeds: range
    range_unit: str
    played: Mapping[str, Columns]
    flock_policy: str | None = None
    best_range: Any = None
    search: Any = None
    tuning: Any = None
    task: str | None = None
    rule: str | None = None

    @property
    def values(self) -> dict[str, FloatArray]:
        """The objective of every flock, shape (flocks,), by policy."""
        return {name: columns["objective"] for name, columns in self.played.items()}

    @property
    def rows(self) -> dict[str, ComparisonRow]:
        """The rows of the table with 95 % intervals over flocks, by policy."""
        from flockesc_env.common import stats  # optional and slow to import

        first, rule = next(iter(self.values.values())), self.values.get(self.rule or "")
        sign = 1 if self.flock_policy is None else -1
        return {
            name: ComparisonRow(
                stats.mean(values),
                stats.mean(values - first),
                None if rule is None else stats.mean(values - rule),
                stats.improvement(sign * values, sign * first),
                *(float(self.played[name][load].mean()) for load in LOADS if load in self.played[name]),
            )
            for name, values in self.values.items()
        }

    def table(self) -> "pl.DataFrame":
        """Return a polars DataFrame with one row per policy and flock: policy, seed, ``played``."""
        seeds, names = np.array(self.seeds, np.uint64), [*self.played]
        columns = {"policy": np.repeat(names, len(seeds)), "seed": np.tile(seeds, len(names))}
        for name in self.played[names[0]]:
            columns[name] = np.concatenate([each[name] for each in self.played.values()])
        return data_frame(columns)

    def write(self, folder: str | Path) -> None:
        """Write table.md and episodes.parquet (``table``) to a folder, which is made."""
        place, search = as_path(folder, "folder"), self.search
        place.mkdir(parents=True, exist_ok=True)
        write_text(place / "table.md", f"{self}\n")
        write_table(self.table(), place / "episodes.parquet", None if search is None else origin(search))

    @figure_style()
    def plot(self) -> "Figure":
        """Return a Matplotlib figure: the objective against the fixed range, and a line per policy.

        Bands are 95 % intervals. A dashed line marks the best fixed range.
        """
        if self.search is None:
            raise InputError("plot", "a comparison of ranges (table() has the objectives)", "predators")
        from matplotlib.figure import Figure  # optional and slow to import

        figure = Figure(figsize=(8.3, 4.2), layout="constrained")
        axes, has_bands, places = figure.subplots(), len(self.seeds) > 1, self.search.interaction_ranges
        axes.set_xlabel(f"interaction range ({self.range_unit})" if self.range_unit else "interaction range")
        if has_bands:
            axes.fill_between(places, *self.search.mean_with_interval(self.spec.name)[1:], color="0.88", lw=0)
        axes.plot(places, self.spec.values(self.search).mean(axis=1), color="0.25", label="one fixed range")
        for place, (name, row) in enumerate(self.rows.items()):
            color, (center, low, high) = f"C{place % 10}", vars(row.objective).values()
            label = f"{self.spec.number(center)} {name}"
            if place == 0:
                axes.axvline(self.best_range, color="0.25", ls="--", lw=1, label=label)
            elif name != ORACLE:
                axes.axhline(center, color=color, label=label)
                if has_bands:
                    axes.axhspan(low, high, color=color, alpha=0.15, lw=0)
        axes.set_ylabel(self.spec.with_unit(self.spec.symbol))
        title = f"{len(self.seeds)} held-out {self.spec.model}s, 95 % intervals"
        axes.set_title(title, loc="left", fontsize="medium")
        axes.margins(x=0)
        axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside right upper", fontsize="small", frameon=False)
        figure.draw_without_rendering()  # creates the labels of ticks in this style
        return figure

    def __str__(self) -> str:
        spec, rule, many = self.spec, self.rule, f"{self.spec.model}s"
        task = f" of the task {self.task}" if self.task else ""
        where = f"{self.scenario} against {self.flock_policy}: the smaller, the better"
        best, what = ("built-in", "predator") if self.flock_policy else ("fixed", "range")
        chosen = "other seeds" if self.tuning is None else f"{len(self.tuning.seeds)} tuning {many}"
        lines = [
            f"{spec.with_unit(spec.symbol)}{task} on {len(self.seeds)} held-out {many}"
            f" in {where if self.flock_policy else self.scenario}; 95 % intervals: t, Wilson for shares.",
            f"Differences to the best {best} {what} are paired. The {what} was chosen on {chosen}.",
        ]
        if self.tuning is not None and (
            self.tuning.interaction_ranges.max() == self.best_range < complete_range(self.search.scenario)
        ):
            lines.append("It is the largest range of the grid: longer ones may be better (ranges=..).")
        head = ["policy", "objective", f"minus best {best}", *([f"minus {rule}"] if rule else [])]
        head.append("probability of improvement")
        if next(iter(self.rows.values())).mean_heard is not None:
            head += [f"mean range ({self.range_unit})", "agents heard"]
        lines += ["", f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
        for place, (name, row) in enumerate(self.rows.items()):
            cells = [name, f"{row.objective:.{spec.digits}f}"]
            cells.append(f"{row.difference:.{spec.digits}f}" if place else "-")
            if row.to_rule is not None:
                cells.append(f"{row.to_rule:.{spec.digits}f}" if name != rule else "-")
            cells.append(f"{row.improvement:.2f}" if place else "-")
            cells += [f"{load:.1f}" for load in (row.mean_range, row.mean_heard) if load is not None]
            lines.append(f"| {' | '.join(cells)} |")
        return "\n".join(lines)

    __repr__ = __str__


def complete_range(scenario: Scenario) -> float:
    """Return the range with which agents hear all others in any state."""
    return {"neighbors": scenario.num_agents - 1.0, "": 1.0}.get(scenario.range_unit, np.inf)
