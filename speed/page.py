"""Tables and the figure of a benchmark run, and tables of a count, in the report and the README."""

import math
import re
import statistics
from collections.abc import Iterable
from pathlib import Path
from textwrap import fill

from matplotlib.figure import Figure
from matplotlib.ticker import StrMethodFormatter

from flockesc_env.render.palette import LIGHT
from speed.measure import PROJECT, Measurements, Record
from speed.models import ARITHMETIC, BANDWIDTH, BYTES
from training.figure_style import WIDTH, label_ends, save_figure

REPORT = Path("speed/results/README.md")
README = Path("README.md")
_LINE_WIDTH = 110  # of text
VECTOR = f"{PROJECT}, Gymnasium vector"
AVX2 = Path("speed/results/avx2.json")  # measurements of a core that was built without AVX-512
IN_AVX2 = (PROJECT, "plain Rust, cell list", "Numba, cell list, fastmath")

_NUMPY, _NUMBA, _JAX, _RUST, _SCIPY = LIGHT.others
# A color per library and a marker per implementation.
_STYLES = {
    PROJECT: (LIGHT.ink, "o"),
    "NumPy, all pairs": (_NUMPY, "s"),
    "NumPy, BLAS": (_NUMPY, "P"),
    "SciPy cKDTree": (_SCIPY, "^"),
    "Numba, cell list, fastmath": (_NUMBA, "D"),
    "JAX, all pairs": (_JAX, "*"),
    "JAX, all pairs, float32": (_JAX, "p"),
    "plain Rust, cell list": (_RUST, "h"),
}


def rendered(page: str, run: Measurements) -> str:
    """Return the page with the blocks of a run, each between ``<!-- its name -->`` and ``<!-- end -->``."""
    records = run.records
    avx2 = [record for record in Measurements.read(AVX2).records if record.implementation in IN_AVX2]
    (vector,) = (record for record in records if record.implementation == VECTOR)
    blocks = {
        "microseconds": _number(1e6 * vector.median / vector.case["flocks"]),
        "kernel": _kernel(records),
        "kernel with AVX2": _kernel(avx2),
        "rules": _rules(records),
        "size": _size(records),
        "grid and line": _grid_and_line(records),
        "environments": _environments(_of(records, "environments")),
        "run": _run(run),
    }
    block = re.compile(rf"(<!-- ({'|'.join(blocks)}) -->\n?).*?(\n?<!-- end -->)", re.DOTALL)
    return block.sub(lambda match: match[1] + blocks[match[2]] + match[3], page)


def with_counts(page: str, counts: dict[str, int]) -> str:
    """Return the page with the table of the counts of instructions."""
    rows = [[name, f"{instructions:,}"] for name, instructions in counts.items()]
    return with_table(page, table(["one step of the paper's flock", "instructions"], rows))


def _of(records: list[Record], section: str, implementation: str = "") -> list[Record]:
    return [r for r in records if r.section == section and implementation in ("", r.implementation)]


def _medians(records: list[Record], section: str) -> dict[str, dict[float, float]]:
    """Return the medians in s by implementation and by range."""
    medians: dict[str, dict[float, float]] = {}
    for record in _of(records, section):
        medians.setdefault(record.implementation, {})[record.case["rho"]] = record.median
    return medians


def draw(records: list[Record], folder: Path) -> list[Path]:
    """Draw the cost of a step against the range, a line per implementation; return the files.

    Without measurements of the section ``kernel`` there is no figure.
    """
    kernel = _medians(records, "kernel")
    figure = Figure(figsize=(WIDTH, 5.4), layout="constrained")
    axes = figure.subplots()
    axes.grid(which="major", color=LIGHT.grid)
    axes.set(xlabel="interaction range (m)", ylabel="time per step of one flock (µs)", yscale="log")
    axes.set_title("A step of the paper's flock: 300 agents, one core")
    axes.margins(y=0.1)
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:,g}"))
    ends = []
    for name, medians in kernel.items():
        micros = [1e6 * median for median in medians.values()]
        color, marker = _STYLES[name]
        width, size, zorder = (3.5, 7, 3) if name == PROJECT else (1.5, 5, 2)
        axes.plot([*medians], micros, color=color, marker=marker, lw=width, ms=size, zorder=zorder)
        ends.append((micros[-1], name, color))
    label_ends(axes, ends, gap=0.06)
    return [save_figure(figure, folder / "cost_against_range.png")] if kernel else []


def _kernel(records: list[Record]) -> str:
    medians = _medians(records, "kernel")
    own = medians.pop(PROJECT)
    rows = [[f"**{PROJECT}**", *(f"**{_number(1e6 * median)}**" for median in own.values())]]
    for name, row in sorted(medians.items(), key=lambda item: sum(item[1].values())):
        cells = (f"{_number(1e6 * row[rho])} ({_number(row[rho] / own[rho])} x)" for rho in own)
        rows.append([name, *cells])
    floors = {r.case["rho"]: r.case["operations"] * r.median for r in _of(records, "floor", ARITHMETIC)}
    if floors:
        rows.append(["arithmetic of all neighbors", *(_number(1e6 * floors[rho]) for rho in own)])
    return table(["range (m)", *(f"{rho:.0f}" for rho in own)], rows)


def _rules(records: list[Record]) -> str:
    names = {"topological": "nearest neighbors: {:,.0f}", "voronoi": "Voronoi neighbors within {:,.0f} m"}
    rows: dict[str, list[str]] = {}
    for record in _of(records, "rules"):
        name = names[record.case["rule"]].format(record.case["rho"])
        rows.setdefault(name, [name]).append(_number(1e6 * record.median))
    return table(["other neighbor rules", PROJECT, "SciPy"], [*rows.values()])


def _size(records: list[Record]) -> str:
    rows = []
    for record in _of(records, "size", PROJECT):
        agents, threads = record.case["n"], record.case.get("threads")
        if agents >= 10_000 and threads in (None, 2):
            cores = "two cores" if threads else "one core"
            rows.append([cores, f"{agents:,}", _number(1e9 * record.median / agents)])
    (traffic,) = _of(records, "floor", BANDWIDTH)
    rows.append([f"memory traffic of {BYTES} bytes, one core", "any", _number(1e9 * BYTES * traffic.median)])
    return table(["larger flocks, 0.03 agents per m^2, range 10 m", "agents", "ns per agent and step"], rows)


def _grid_and_line(records: list[Record]) -> str:
    one, two = _of(records, "grid")
    line = _medians(records, "line")

    def limits(implementation: str) -> str:
        micros = [1e6 * seconds for seconds in line[implementation].values()]
        return " to ".join(dict.fromkeys(map(_number, (min(micros), max(micros))))) + " us"

    return fill(
        f"The paper's grid search, {one.case['ranges']} ranges on {one.case['seeds']} flocks, takes "
        f"{_number(one.median)} s on one core and {_number(two.median)} s on two. A step of the line "
        f"of 100 agents takes {limits(PROJECT)}; all pairs in NumPy take {limits('NumPy, all pairs')}.",
        _LINE_WIDTH,
    )


def _environments(records: Iterable[Record]) -> str:
    rows = []
    for record in sorted(records, key=lambda record: record.median / record.case["flocks"]):
        agents, flocks = record.case["agents"], record.case["flocks"]
        name = record.implementation.replace(PROJECT, f"**{PROJECT}**")
        figure = _number(1e6 * record.median / flocks)
        rows.append([name, str(agents), str(flocks), f"**{figure}**" if "*" in name else figure])
    return table(["environment", "agents", "flocks", "us per step"], rows)


def _run(run: Measurements) -> str:
    machine = run.machine
    first = {(r.section, r.implementation, str(r.case)): r.median for r in run.records}
    changes = []
    for record in run.again:
        ratio = first[record.section, record.implementation, str(record.case)] / record.median
        changes.append((100 * (max(ratio, 1 / ratio) - 1), record.implementation))
    typical = statistics.median(change for change, _ in changes)
    largest, name = max(changes)
    widest = [flag for flag in machine["instruction_sets"] if flag in ("avx512f", "avx2", "sse2")][-1]
    versions = ", ".join(f"{name} {number}" for name, number in machine["packages"].items())
    items = (
        f"Processor: {machine['cpu']}, {machine['cores']} cores, widest instruction set {widest}. "
        f"Python {machine['python']}, {machine['rust'].split(' (')[0]}.",
        f"Versions: {versions}.",
        "The tables of the model and of environments were measured again at the end of the run. The two "
        f"figures of a cell differ by {typical:.0f} % in the median and by at most {largest:.0f} % ({name}).",
    )
    return "\n".join(fill(f"- {item}", _LINE_WIDTH, subsequent_indent="  ") for item in items)


def with_table(page: str, table: str) -> str:
    """Return a page with a table instead of the one of the same head."""
    head, _, _ = table.partition("\n")
    before, _, after = page.partition(head)
    return before + table + after[after.index("\n\n") :]


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [f"| {' | '.join(line)} |" for line in [head, *rows]]
    return "\n".join([lines[0], "|" + "---|" * len(head), *lines[1:]])


def _number(value: float) -> str:
    """Return a number with two significant digits, or three from 100 on."""
    digits = 2 if value < 100 else 3
    rounded = round(value, digits - 1 - math.floor(math.log10(value)))
    return f"{rounded:,.0f}" if rounded >= 10 else f"{rounded:.1f}"
