"""Entry point of ``python -m speed``."""

import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Literal, get_args

from flockesc_env.cli.application import Application
from flockesc_env.cli.output import Exit, show, table
from flockesc_env.common.files import write_text
from speed import instructions, models, page, peers
from speed.environments import environments, own_parts
from speed.measure import Comparison, Measurements, machine, measure

Section = Literal["kernel", "size", "environments", "line", "grid", "rules", "floor", "own-parts"]
_DEFAULT = get_args(Section)[:-1]
_RESULTS = Path("speed/results")
_FILE = "benchmarks.json"
_REPEATED = ("kernel", "environments")  # measured again at the end of a run

BENCHMARKS: dict[Section, Callable[..., Iterator[Comparison]]] = {
    "kernel": models.kernel,
    "size": models.size,
    "environments": environments,
    "line": models.line,
    "grid": models.grid,
    "rules": models.rules,
    "floor": models.floor,
    "own-parts": own_parts,
}
"""Functions that take the peers, and ``quick`` for few and small cases, and yield what to measure."""


def run(only: tuple[Section, ...] = _DEFAULT, quick: bool = False, output: Path = _RESULTS) -> Exit:
    """Check that peers agree with this project, measure, and write measurements and figures.

    Args:
        only: sections to measure; by default all but own-parts.
        quick: few repetitions and small sizes, to test the benchmarks; the results are not meaningful.
        output: folder for the measurements and the figures.
    """
    from threadpoolctl import threadpool_limits

    measurements = Measurements(machine(), [], [])
    with threadpool_limits(1):  # of BLAS: all candidates use one thread
        others = peers.installed()
        peers.check(others)
        runs = [(measurements.records, name) for name in only]
        runs += [(measurements.again, name) for name in only if name in _REPEATED]
        for records, name in runs:
            print(f"measuring: {name}", flush=True)
            for comparison in BENCHMARKS[name](others, quick=quick):
                records += measure(name, comparison, quick=quick)
    output.mkdir(parents=True, exist_ok=True)
    write_text(output / _FILE, json.dumps(asdict(measurements), indent=1) + "\n")
    rows = [
        [r.section, str(r.case), r.implementation, f"{1e6 * r.median:#,.4g}".rstrip("."), r.unit]
        for r in measurements.records
    ]
    show(*table(["section", "case", "implementation", "us", "per"], rows))
    for path in page.draw(measurements.records, output):
        print("Figure:", path)
    return Exit.DONE


def write_pages() -> Exit:
    """Draw the figures and write the tables of the report and the README from speed/results."""
    measurements = Measurements.read(_RESULTS / _FILE)
    page.draw(measurements.records, _RESULTS)
    for path in (page.REPORT, page.README):
        write_text(path, page.rendered(path.read_text("utf-8"), measurements))
    return Exit.DONE


def count_instructions() -> Exit:
    """Count the instructions of steps and observations, beside earlier counts; write the report."""
    file = instructions.RESULTS
    earlier: dict[str, int] = json.loads(file.read_text())
    counts = instructions.count()
    rows = [
        [name, f"{count:,}", f"{count / earlier[name]:.3f}" if name in earlier else "-"]
        for name, count in counts.items()
    ]
    show(*table(["benchmark", "instructions", "ratio to before"], rows))
    write_text(file, json.dumps(counts, indent=1) + "\n")
    write_text(page.REPORT, page.with_counts(page.REPORT.read_text("utf-8"), counts))
    return Exit.DONE


SPEED = Application(
    "python -m speed",
    "Measure the speed beside peers.",
    {"run": run, "page": write_pages, "instructions": count_instructions},
)

if __name__ == "__main__":
    sys.exit(SPEED.main())
