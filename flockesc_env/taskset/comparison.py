"""``Comparison``: policies beside the best fixed range, on held-out flocks; needs the extra ``analysis``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flockesc_env.common import stats
from flockesc_env.common.array_files import write_table
from flockesc_env.common.extras import data_frame
from flockesc_env.common.files import write_text
from flockesc_env.common.progress import progress_bar
from flockesc_env.common.stats import Estimate, FloatArray
from flockesc_env.models.sweep import FlockSweepResult, LineSweepResult, sweep
from flockesc_env.policies.rollout import play
from flockesc_env.policies.setup import Setup
from flockesc_env.scenario.objectives import ObjectiveSpec

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
        task: name of the task.
        scenario: name of the scenario.
        spec: the objective.
        rule: name of the task's rule, the best policy without training.
        search: the grid search over fixed ranges on these flocks.
        values: objective of every flock, shape (flocks,), by policy; the best fixed range is first.
    """

    task: str
    scenario: str
    spec: ObjectiveSpec
    rule: str
    search: FlockSweepResult | LineSweepResult
    values: Mapping[str, FloatArray]

    @property
    def rows(self) -> dict[str, ComparisonRow]:
        """The rows of the table with 95 % intervals over flocks, by policy."""
        fixed, rule = next(iter(self.values.values())), self.values[self.rule]
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
        spec, rule = self.spec, self.rule
        lines = [
            f"{spec.with_unit(spec.symbol)} of the task {self.task} on {len(self.search.seeds)} held-out"
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


def play_all(
    entries: Mapping[str, Setup], best: float, spec: ObjectiveSpec, seeds: range
) -> tuple[FlockSweepResult | LineSweepResult, dict[str, FloatArray]]:
    """Play policies and fixed ranges in the scenario of the first policy; see ``Comparison``."""
    first = next(iter(entries.values()))
    ranges = np.union1d(first.scenario.search_ranges, best)
    with progress_bar("Fixed ranges", ranges.size * len(seeds)) as report:
        search: Any = sweep(first.scenario, ranges, seeds, num_threads=first.num_threads, progress=report)
    fixed = f"best fixed range ({best:g}{spec.unit and ' m'})"
    values = {fixed: spec.values(search)[ranges.searchsorted(best)]}
    values[ORACLE] = search.hindsight_oracle(spec.name)
    for name, entry in entries.items():
        with progress_bar(f"Policy {name}", len(seeds)) as report:
            values[name] = play(entry, seeds, progress=report)[spec.name]
    return search, values
