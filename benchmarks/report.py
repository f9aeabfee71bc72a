"""Tables of a benchmark run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks import PROJECT
from benchmarks.measure import Record


@dataclass(frozen=True)
class Layout:
    """A table: a row per contender, a column per value of one entry of the case.

    Attributes:
        title: with the unit of the figures.
        section: of the records.
        case: the entries that the case of a record must have.
        columns: which of them runs along the columns.
        value: the figure to show.
        only: entries with values that the case must have.
    """

    title: str
    section: str
    case: set[str]
    columns: str
    value: Callable[[Record], float]
    only: tuple[tuple[str, Any], ...] = ()

    def has(self, record: Record) -> bool:
        """Return whether a record belongs to the table."""
        return (
            record.section == self.section
            and set(record.case) == self.case
            and set(self.only) <= record.case.items()
        )


LAYOUTS = (
    Layout(
        "Flock of 300: us per step, against the range in m (one core)",
        "kernel",
        {"rho"},
        "rho",
        lambda record: 1e6 * record.median,
    ),
    Layout(
        "Flock at 0.03 agents per m^2, 10 m: M agent-steps/s, against size (one core; -: over 2 s a step)",
        "size",
        {"n", "rho"},
        "n",
        lambda record: record.case["n"] / record.median / 1e6,
    ),
    Layout(
        "Flock of 100,000 in 100 m x 100 m: ms per step, against the range (one core; -: over 5 s a step)",
        "size",
        {"n", "side", "rho"},
        "rho",
        lambda record: 1e3 * record.median,
    ),
    Layout(
        "Flock of 1,000,000, 10 m: ms of wall time per step, against threads",
        "size",
        {"n", "rho", "threads"},
        "threads",
        lambda record: 1e3 * record.median,
    ),
    Layout(
        "Line of 100: us per step, against the range (one core)",
        "line",
        {"rho"},
        "rho",
        lambda record: 1e6 * record.median,
    ),
    *(
        Layout(
            f"Flock of 300, {name} neighbors: us per step, against {columns} (one core)",
            "rules",
            {"rule", "rho"},
            "rho",
            lambda record: 1e6 * record.median,
            (("rule", name),),
        )
        for name, columns in {"topological": "their number", "voronoi": "the range in m"}.items()
    ),
    Layout(
        "A fixed amount of work: ms of wall time, against threads (one piece each, or one shared batch)",
        "threads",
        {"threads"},
        "threads",
        lambda record: 1e3 * record.median,
    ),
    Layout(
        "Grid search: s of wall time, against threads",
        "grid",
        {"ranges", "seeds", "threads"},
        "threads",
        lambda record: record.median,
    ),
)


def show(records: list[Record]) -> None:
    """Print a table per measured section."""
    console = Console(width=132)
    for layout in LAYOUTS:
        chosen = [record for record in records if layout.has(record)]
        if chosen:
            console.print(f"\n{layout.title}", _table(layout, chosen))
    environments = [record for record in records if record.section == "environments"]
    if environments:
        console.print("\nEnvironments (one core)", _environments(environments))


def _table(layout: Layout, records: list[Record]) -> Table:
    columns = list(dict.fromkeys(record.case[layout.columns] for record in records))
    figures = {(r.contender, r.case[layout.columns]): layout.value(r) for r in records}
    table = _empty(*(f"{column:,.7g}" for column in columns))
    names = dict.fromkeys(record.contender for record in records)
    for name in sorted(names, key=lambda name: name != PROJECT):
        row = [_figure(figures.get((name, column), math.nan)) for column in columns]
        table.add_row(name, *row, style="bold" if name == PROJECT else "")
    return table


def _environments(records: list[Record]) -> Table:
    table = _empty("agents", "flocks", "us per step", "us per flock", "M agent-steps/s")
    for record in records:
        agents, flocks = record.case["agents"], record.case["flocks"]
        micros = 1e6 * record.median
        figures = [agents, flocks, micros, micros / flocks, agents * flocks / micros]
        style = "bold" if record.contender.startswith(PROJECT) else ""
        table.add_row(record.contender, *map(_figure, figures), style=style)
    return table


def _empty(*columns: str) -> Table:
    """Return a table without rows: a column of names and the given columns."""
    table = Table("")
    for name in columns:
        table.add_column(name, justify="right")
    return table


def _figure(value: float) -> str:
    """Return a number with three significant digits; "-" for NaN."""
    if math.isnan(value):
        return "-"
    if isinstance(value, int) or abs(value) >= 100:
        return f"{value:,.0f}"
    return f"{value:#.3g}".rstrip(".")
