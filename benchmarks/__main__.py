"""Entry point of ``python -m benchmarks``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import tyro

from benchmarks import (
    environments,
    frameworks,
    grid,
    instructions,
    kernel,
    line,
    machine,
    page,
    peers,
    plots,
    report,
    rules,
    size,
    threads,
)
from benchmarks.measure import Record
from flockesc_env.cli.output import prepare_terminal
from flockesc_env.common.files import write_text

Section = Literal["kernel", "size", "environments", "line", "grid", "rules", "threads"]
_FILE = "benchmarks.json"


@dataclass(frozen=True)
class RunArgs:
    """Arguments of ``run``.

    Attributes:
        only: sections to measure; default: all.
        quick: few repetitions and small sizes, to test the benchmarks; the results are not meaningful.
        output: folder for the measurements and the figures.
    """

    only: tuple[Section, ...] = get_args(Section)
    quick: bool = False
    output: Path = Path("results/benchmarks")


@dataclass(frozen=True)
class PlotArgs:
    """Arguments of ``plot`` and ``page``.

    Attributes:
        output: folder with the measurements of an earlier run; ``plot`` writes the figures there.
    """

    output: Path = Path("results/benchmarks")


@dataclass(frozen=True)
class InstructionsArgs:
    """Arguments of ``instructions``.

    Attributes:
        runner: the program ``gungraun-runner``.
        output: file of the counts; the earlier counts in it are shown beside the new ones.
    """

    runner: Path = Path(".compat/cargo/bin/gungraun-runner")
    output: Path = instructions.RESULTS


app = tyro.extras.SubcommandApp()


@app.command(name="run")
def _run(args: Annotated[RunArgs, tyro.conf.arg(name="")]) -> None:
    """Check that peers agree with this project, measure, and write tables, measurements and figures."""
    from threadpoolctl import threadpool_limits

    machine_description = machine.description()
    with threadpool_limits(1):  # of BLAS: all candidates use one thread
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
        records: dict[str, list[Record]] = {"records": [], "again": []}
        repeated = [("again", name) for name in page.REPEATED if name in args.only]
        for kind, name in [*(("records", name) for name in args.only), *repeated]:
            print(f"measuring: {name}", flush=True)
            records[kind] += sections[name]()
    report.show(records["records"])
    _save(machine_description, records, args.output)
    for path in plots.draw(records["records"], args.output):
        print("Figure:", path)


@app.command(name="plot")
def _plot(args: Annotated[PlotArgs, tyro.conf.arg(name="")]) -> None:
    """Print the tables and draw the figures of an earlier run again."""
    document = json.loads((args.output / _FILE).read_text())
    records = [Record.from_document(entry) for entry in document["records"]]
    report.show(records)
    for path in plots.draw(records, args.output):
        print("Figure:", path)


@app.command(name="page")
def _page(args: Annotated[PlotArgs, tyro.conf.arg(name="")]) -> None:
    """Write the tables of docs/performance.md and README.md from an earlier run."""
    document = json.loads((args.output / _FILE).read_text())
    for path in page.PAGES:
        write_text(path, page.rendered(path.read_text("utf-8"), document))


@app.command(name="frameworks")
def _frameworks(args: Annotated[frameworks.FrameworksArgs, tyro.conf.arg(name="")]) -> None:
    """Write the table of docs/trainers.md, after measuring one example if it is named."""
    frameworks.run(args)


@app.command(name="instructions")
def _instructions(args: Annotated[InstructionsArgs, tyro.conf.arg(name="")]) -> None:
    """Count the instructions of steps and observations, beside earlier counts; write docs/performance.md."""
    earlier = json.loads(args.output.read_text()) if args.output.exists() else {}
    counts = instructions.count(args.runner)
    instructions.show(counts, earlier)
    write_text(args.output, json.dumps(counts, indent=1) + "\n")
    rendered = instructions.rendered(instructions.PAGE.read_text("utf-8"), counts)
    write_text(instructions.PAGE, rendered)


def _save(machine_description: dict[str, Any], records: dict[str, list[Record]], folder: Path) -> None:
    documents = {kind: [record.document() for record in measured] for kind, measured in records.items()}
    document = {"machine": machine_description, **documents}
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / _FILE, json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    prepare_terminal()
    app.cli(prog="python -m benchmarks", description="Measure the speed of this project and its peers.")
