"""The table of a benchmark run: a row per measurement."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from speed import PROJECT
from speed.measure import Record


def show(records: list[Record]) -> None:
    """Print the median time per unit of work of every record."""
    table = Table("section", "case", "contender", "us", "per")
    before = None
    for record in records:
        case = ", ".join(f"{name} {value}" for name, value in record.case.items())
        figure = f"{1e6 * record.median:#,.4g}".rstrip(".") if record.seconds else record.note
        style = "bold" if record.contender.startswith(PROJECT) else ""
        if before not in (None, record.section):
            table.add_section()
        table.add_row(record.section, case, record.contender, figure, record.unit, style=style)
        before = record.section
    Console(width=132).print(table)
