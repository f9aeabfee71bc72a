"""Entry point of ``python -m speed``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal, Protocol, get_args

import tyro

from flockesc_env.cli.flags import NUMBERS
from flockesc_env.cli.output import prepare_terminal
from flockesc_env.common.files import write_text
from speed import flocks, frameworks, instructions, machine, page, peers, plots, report
from speed.environments import environments
from speed.floor import floor
from speed.line import line
from speed.measure import Comparison, Record, measure
from speed.peers.model import Peer
from speed.size import size

Section = Literal["kernel", "size", "environments", "line", "grid", "rules", "floor"]
_RESULTS = Path("speed/results")


class Benchmark(Protocol):
    """Yields what to measure; ``quick``: few and small cases, to test the benchmark."""

    def __call__(self, others: list[Peer], /, *, quick: bool) -> Iterator[Comparison]: ...  # noqa: D102


BENCHMARKS: dict[Section, Benchmark] = {
    "kernel": flocks.kernel,
    "size": size,
    "environments": environments,
    "line": line,
    "grid": flocks.grid,
    "rules": flocks.rules,
    "floor": floor,
}

app = tyro.extras.SubcommandApp()


@app.command
def run(only: tuple[Section, ...] = get_args(Section), quick: bool = False, output: Path = _RESULTS) -> None:
    """Check that peers agree with this project, measure, and write measurements and figures.

    Args:
        only: sections to measure.
        quick: few repetitions and small sizes, to test the benchmarks; the results are not meaningful.
        output: folder for the measurements and the figures.
    """
    from threadpoolctl import threadpool_limits

    document: dict[str, Any] = {"machine": machine.description()}
    with threadpool_limits(1):  # of BLAS: all candidates use one thread
        others = peers.installed()
        peers.check(others)
        again = [name for name in only if name in page.REPEATED]
        for kind, names in (("records", only), ("again", again)):
            measured = [record for name in names for record in _measured(name, others, quick=quick)]
            document[kind] = [record.document() for record in measured]
    output.mkdir(parents=True, exist_ok=True)
    write_text(_file(output), json.dumps(document, indent=1) + "\n")
    plot(output)


@app.command
def plot(output: Path = _RESULTS) -> None:
    """Print the table and draw the figures of an earlier run.

    Args:
        output: folder with the measurements; the figures are written there.
    """
    records = [Record.from_document(entry) for entry in _read(_file(output))["records"]]
    report.show(records)
    for path in plots.draw(records, output):
        print("Figure:", path)


@app.command(name="page")
def write_pages(output: Path = _RESULTS) -> None:
    """Write the tables of docs/performance.md and README.md from an earlier run.

    Args:
        output: folder with the measurements.
    """
    for path in page.PAGES:
        _rewrite(path, page.rendered, _read(_file(output)))


@app.command(name="instructions")
def count_instructions(output: Path = instructions.RESULTS) -> None:
    """Count the instructions of steps and observations, beside earlier counts; write docs/performance.md.

    Args:
        output: file of the counts; the earlier counts in it are shown beside the new ones.
    """
    earlier = _read(output) if output.exists() else {}
    counts = instructions.count()
    instructions.show(counts, earlier)
    write_text(output, json.dumps(counts, indent=1) + "\n")
    _rewrite(instructions.PAGE, instructions.rendered, counts)


app.command(frameworks.frameworks)


def _measured(name: Section, others: list[Peer], *, quick: bool) -> list[Record]:
    print(f"measuring: {name}", flush=True)
    comparisons = BENCHMARKS[name](others, quick=quick)
    return [record for comparison in comparisons for record in measure(name, comparison, quick=quick)]


def _file(folder: Path) -> Path:
    return folder / "benchmarks.json"


def _read(path: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(path.read_text())
    return document


def _rewrite(path: Path, rendered: Callable[[str, dict[str, Any]], str], document: dict[str, Any]) -> None:
    write_text(path, rendered(path.read_text("utf-8"), document))


if __name__ == "__main__":
    prepare_terminal()
    app.cli(
        prog="python -m speed",
        description="Measure the speed of this project and its peers.",
        registry=NUMBERS,
    )
