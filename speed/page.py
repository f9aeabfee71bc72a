"""The tables of docs/performance.md and README.md that come from a benchmark run."""

from __future__ import annotations

import json
import math
import re
import statistics
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

from speed import PROJECT
from speed.floor import ARITHMETIC, BANDWIDTH, BYTES
from speed.measure import Record

PAGES = (Path("docs/performance.md"), Path("README.md"))
WIDTH = 110
"""Of lines of text."""
REPEATED = ("kernel", "environments")
"""Sections that are measured again at the end of a run."""
VECTOR = f"{PROJECT}, Gymnasium vector"
IN_README = (VECTOR, "VMAS flocking", "JAX, all pairs", "JAX, all pairs, float32")
AVX2 = Path("speed/results/avx2.json")
"""Measurements of a core that was built without AVX-512."""
IN_AVX2 = (PROJECT, "plain Rust, cell list", "Numba, cell list, fastmath")


def rendered(page: str, document: dict[str, Any]) -> str:
    """Return the page with the blocks of a run, each between ``<!-- its name -->`` and ``<!-- end -->``."""
    records, again = _records(document, "records"), _records(document, "again")
    avx2 = [r for r in _records(json.loads(AVX2.read_text()), "records") if r.contender in IN_AVX2]
    blocks = {
        "microseconds": _microseconds(records),
        "kernel": _kernel(records),
        "kernel with AVX2": _kernel(avx2),
        "rules": _rules(records),
        "size": _size(records),
        "grid and line": _grid_and_line(records),
        "environments": _environments(records),
        "environments in short": _in_short(records),
        "run": _run(document["machine"], records, again),
    }

    def block(match: re.Match[str]) -> str:
        start, name, end = match.groups()
        return start + blocks[name] + end

    names = "|".join(blocks)
    return re.sub(rf"(<!-- ({names}) -->\n?).*?(\n?<!-- end -->)", block, page, flags=re.DOTALL)


def _records(document: dict[str, Any], kind: str) -> list[Record]:
    return [Record.from_document(entry) for entry in document[kind]]


def _microseconds(records: list[Record]) -> str:
    """Return the microseconds per step of a flock in the vector environment."""
    (record,) = (record for record in records if record.contender == VECTOR)
    return _number(1e6 * record.median / record.case["flocks"])


def _kernel(records: list[Record]) -> str:
    medians = _medians(records, "kernel", "rho")
    ranges = list(medians[PROJECT])
    rows = []
    for name, row in sorted(medians.items(), key=lambda item: sum(item[1].values())):
        own = [medians[PROJECT][rho] for rho in ranges]
        cells = [
            f"**{_number(1e6 * row[rho])}**"
            if name == PROJECT
            else f"{_number(1e6 * row[rho])} ({_number(row[rho] / base)} x)"
            for rho, base in zip(ranges, own, strict=True)
        ]
        rows.append([f"**{name}**" if name == PROJECT else name, *cells])
    floors = {r.case["rho"]: r.case["operations"] * r.median for r in _floors(records, ARITHMETIC)}
    if floors:
        rows.append(["arithmetic of all neighbors", *(_number(1e6 * floors[rho]) for rho in ranges)])
    return table(["range (m)", *(f"{rho:.0f}" for rho in ranges)], rows)


def _rules(records: list[Record]) -> str:
    names = {"topological": "nearest neighbors: {:,.0f}", "voronoi": "Voronoi neighbors within {:,.0f} m"}
    rows: dict[str, list[str]] = {}
    for record in (record for record in records if record.section == "rules"):
        row = rows.setdefault(names[record.case["rule"]].format(record.case["rho"]), [])
        row.append(_number(1e6 * record.median))
    return table(["other neighbor rules", PROJECT, "SciPy"], [[name, *row] for name, row in rows.items()])


def _size(records: list[Record]) -> str:
    rows = []
    for record in records:
        agents = record.case.get("n", 0)
        is_own = record.section == "size" and record.contender == PROJECT and "side" not in record.case
        if is_own and agents >= 10_000 and record.seconds and record.case.get("threads", 2) == 2:
            cores = "two cores" if "threads" in record.case else "one core"
            rows.append([cores, f"{agents:,}", _number(1e9 * record.median / agents)])
    name = f"memory traffic of {BYTES} bytes, one core"
    rows.extend([name, "any", _number(1e9 * BYTES * r.median)] for r in _floors(records, BANDWIDTH))
    return table(["larger flocks, 0.03 agents per m^2, range 10 m", "agents", "ns per agent and step"], rows)


def _floors(records: list[Record], name: str) -> list[Record]:
    return [record for record in records if record.section == "floor" and record.contender == name]


def _grid_and_line(records: list[Record]) -> str:
    grid = {r.case["threads"]: r for r in records if r.section == "grid"}
    case = grid[1].case
    line = _medians(records, "line", "rho")

    def limits(contender: str) -> str:
        micros = [1e6 * seconds for seconds in line[contender].values()]
        return " to ".join(dict.fromkeys(map(_number, (min(micros), max(micros))))) + " us"

    return fill(
        f"The paper's grid search, {case['ranges']} ranges on {case['seeds']} flocks, takes "
        f"{_number(grid[1].median)} s on one core and {_number(grid[2].median)} s on two. A step of the line "
        f"of 100 agents takes {limits(PROJECT)}; all pairs in NumPy take {limits('NumPy, all pairs')}.",
        WIDTH,
    )


def _environments(records: list[Record]) -> str:
    return _environment_table(record for record in records if record.section == "environments")


def _in_short(records: list[Record]) -> str:
    """Return a few environments, and JAX, which steps 64 flocks without observations."""
    chosen = []
    for record in (record for record in records if record.contender in IN_README):
        if record.section == "environments":
            chosen.append(record)
        elif record.section == "kernel" and record.case["rho"] == 10:
            seconds = [64 * each for each in record.seconds]
            chosen.append(replace(record, case={"agents": 300, "flocks": 64}, seconds=seconds))
    return _environment_table(chosen)


def _environment_table(records: Iterable[Record]) -> str:
    rows = []
    for record in sorted(records, key=lambda record: record.median / record.case["flocks"]):
        agents, flocks = record.case["agents"], record.case["flocks"]
        is_own = record.contender.startswith(PROJECT)
        name = record.contender.replace(PROJECT, f"**{PROJECT}**")
        figure = _number(1e6 * record.median / flocks)
        rows.append([name, str(agents), str(flocks), f"**{figure}**" if is_own else figure])
    return table(["environment", "agents", "flocks", "us per step"], rows)


def _run(machine: dict[str, Any], records: list[Record], again: list[Record]) -> str:
    first = {(r.section, r.contender, str(r.case)): r.median for r in records}
    changes = []
    for record in (record for record in again if record.seconds):
        ratio = first[record.section, record.contender, str(record.case)] / record.median
        changes.append((100 * (max(ratio, 1 / ratio) - 1), record.contender))
    typical = statistics.median(change for change, _ in changes)
    largest, name = max(changes)
    widest = next(
        flag for flag in reversed(machine["instruction_sets"]) if flag in ("avx512f", "avx2", "sse2")
    )
    versions = ", ".join(f"{name} {number}" for name, number in machine["packages"].items())
    items = (
        f"Processor: {machine['cpu']}, {machine['cores']} cores, widest instruction set {widest}. "
        f"Python {machine['python']}, {machine['rust'].split(' (')[0]}.",
        f"Versions: {versions}.",
        "The tables of the model and of environments were measured again at the end of the run. The two "
        f"figures of a cell differ by {typical:.0f} % in the median and by at most {largest:.0f} % ({name}).",
    )
    return "\n".join(fill(f"- {item}", WIDTH, subsequent_indent="  ") for item in items)


def _medians(records: list[Record], section: str, column: str) -> dict[str, dict[float, float]]:
    """Return the medians in s by contender and by an entry of the case."""
    medians: dict[str, dict[float, float]] = {}
    for record in records:
        if record.section == section:
            medians.setdefault(record.contender, {})[record.case[column]] = record.median
    return medians


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
