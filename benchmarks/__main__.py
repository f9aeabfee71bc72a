"""Command line: ``python -m benchmarks run | plot``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import tyro
from threadpoolctl import threadpool_limits

from benchmarks import environments, grid, kernel, line, machine, peers, plots, report, rules, size, threads
from benchmarks.measure import Record

Section = Literal["kernel", "size", "environments", "line", "grid", "rules", "threads"]
_FILE = "benchmarks.json"


@dataclass(frozen=True)
class RunArgs:
    """What to measure.

    Attributes:
        only: sections to measure.
        quick: a smoke run with few repetitions and small sizes; its figures mean little.
        output: folder for the records and the figures.
    """

    only: tuple[Section, ...] = get_args(Section)
    quick: bool = False
    output: Path = Path("results/benchmarks")


@dataclass(frozen=True)
class PlotArgs:
    """What to draw.

    Attributes:
        output: folder that holds the records of a run.
    """

    output: Path = Path("results/benchmarks")


app = tyro.extras.SubcommandApp()


@app.command(name="run")
def _run(args: Annotated[RunArgs, tyro.conf.arg(name="")]) -> None:
    """Check every peer against this project, measure, print tables, save every repetition, draw."""
    surroundings = machine.description()
    with threadpool_limits(1):  # of BLAS: everybody has one thread, this project too
        others = peers.installed()
        peers.check(others)
        sections = {
            "kernel": lambda: kernel.run(others, quick=args.quick),
            "size": lambda: size.run(others, quick=args.quick),
            "environments": lambda: environments.run(quick=args.quick),
            "line": lambda: line.run(quick=args.quick),
            "grid": lambda: grid.run(quick=args.quick),
            "rules": lambda: rules.run(quick=args.quick),
            "threads": lambda: threads.run(quick=args.quick),
        }
        records: list[Record] = []
        for name in args.only:
            print(f"measuring: {name}", flush=True)
            records += sections[name]()
    report.show(records)
    _save(surroundings, records, args.output)
    for path in plots.draw(records, args.output):
        print("Figure:", path)


@app.command(name="plot")
def _plot(args: Annotated[PlotArgs, tyro.conf.arg(name="")]) -> None:
    """Print the tables and draw the figures of a run again, from its file alone."""
    document = json.loads((args.output / _FILE).read_text())
    records = [Record.from_document(entry) for entry in document["records"]]
    report.show(records)
    for path in plots.draw(records, args.output):
        print("Figure:", path)


def _save(surroundings: dict[str, Any], records: list[Record], folder: Path) -> None:
    document = {"machine": surroundings, "records": [record.document() for record in records]}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / _FILE).write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    app.cli(description="Measure this project beside its peers, in one run.")
