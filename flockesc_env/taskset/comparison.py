"""``Comparison``: policies beside the best fixed range, on held-out flocks; needs the extra ``analysis``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from flockesc_env.common import stats
from flockesc_env.common.array_files import write_table
from flockesc_env.common.extras import data_frame
from flockesc_env.common.files import write_text
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.models.sweep import FlockSweepResult, LineSweepResult
from flockesc_env.taskset.definition import TaskDefinition

if TYPE_CHECKING:
    import polars as pl

ORACLE: Final = "hindsight oracle over fixed ranges"


@dataclass(frozen=True)
class ComparisonRow:
    """What a policy reaches: its objective, and its paired differences.

    Attributes:
        objective: mean objective.
        difference: mean paired difference to the best fixed range.
        to_rule: mean paired difference to the task's rule.
        improvement: share of flocks with a larger objective than under the best fixed range; ties count half.
    """

    objective: Estimate
    difference: Estimate
    to_rule: Estimate
    improvement: Estimate


@dataclass(frozen=True, eq=False)
class Comparison:
    """The objectives of policies on the same flocks; see ``Task.compare``. Printing it is the table.

    Attributes:
        task: the task.
        scenario: name of the scenario.
        search: the grid search over fixed ranges on these flocks.
        values: objective of every flock, shape (flocks,), by policy; the best fixed range is first.
    """

    task: TaskDefinition
    scenario: str
    search: FlockSweepResult | LineSweepResult
    values: Mapping[str, FloatArray]

    @property
    def rows(self) -> dict[str, ComparisonRow]:
        """The rows of the table with 95 % intervals over flocks, by policy."""
        fixed, rule = next(iter(self.values.values())), self.values[self.task.shortcut.policy]
        return {
            name: ComparisonRow(
                stats.mean(values),
                stats.mean(values - fixed),
                stats.mean(values - rule),
                stats.improvement(values, fixed),
            )
            for name, values in self.values.items()
        }

    def to_polars(self) -> pl.DataFrame:
        """Return one row per policy and flock: policy, seed, objective."""
        table = data_frame({"seed": self.search.seeds, **self.values})
        return table.unpivot(index="seed", variable_name="policy", value_name="objective")

    def write(self, folder: Path) -> None:
        """Write table.md and episodes.parquet (``to_polars``) to a folder, which is made."""
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / "table.md", f"{self}\n")
        write_table(self.to_polars(), folder / "episodes.parquet")

    def __str__(self) -> str:
        spec, rule = self.task.spec, self.task.shortcut.policy
        lines = [
            f"{spec.with_unit(spec.symbol)} of the task {self.task.name} on {len(self.search.seeds)} held-out"
            f" {spec.model}s in {self.scenario}; 95 % intervals: t, Wilson for shares.",
            "Differences to the best fixed range are paired. The range was chosen on other seeds.",
            "",
            f"| policy | objective | minus best fixed | minus {rule} | probability of improvement |",
            "|---|---|---|---|---|",
        ]
        for place, (name, row) in enumerate(self.rows.items()):
            numbers = [f"{one:.{spec.digits}f}" for one in (row.objective, row.difference, row.to_rule)]
            compared = numbers[1:] if name != rule else [numbers[1], "-"]
            compared = [*compared, f"{row.improvement:.2f}"] if place else ["-", compared[1], "-"]
            lines.append(f"| {' | '.join([name, numbers[0], *compared])} |")
        return "\n".join(lines)

    __repr__ = __str__


def grid_of(task: TaskDefinition) -> tuple[float, ...]:
    """Return the fixed ranges among which the best one of a task is chosen."""
    return task.scenario.search_ranges
