"""Instructions of one step or observation, counted by callgrind, beside the counts of an earlier run."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

from rich.console import Console
from rich.table import Table

RESULTS = Path("results/benchmarks/instructions.json")
PAGE = Path("docs/performance.md")
HEAD = "| paper's flock after 100 steps, range in m | instructions |"
# Benchmarks of steps advance by as many (rust/kernels/instructions.rs).
STEPS = 10

_COMMAND = (
    "cargo",
    "bench",
    "--quiet",
    "--package=flockesc-kernels",
    "--bench=instructions",
    "--",
    "--output-format=json",
)


def count(runner: Path) -> dict[str, int]:
    """Return the instructions of every benchmark in ``rust/kernels/instructions.rs``.

    Args:
        runner: the program ``gungraun-runner``.
    """
    environment = {**os.environ, "GUNGRAUN_RUNNER": str(runner.absolute())}
    done = subprocess.run(_COMMAND, capture_output=True, text=True, check=True, env=environment)
    counts = {}
    for line in done.stdout.splitlines():
        document = json.loads(line)
        setup = document["description"].removeprefix("(").removesuffix(")").replace('"', "")
        total = document["profiles"][0]["data"]["total"]["metrics"]
        name, instructions = document["function_name"], int(total["Ir"]["values"]["new"])
        counts[f"{name} {setup}"] = instructions // STEPS if "step" in name else instructions
    return counts


def show(counts: dict[str, int], earlier: dict[str, int]) -> None:
    """Print the counts and their ratios to earlier ones."""
    table = Table("benchmark", "instructions", "ratio to before", title="Instructions")
    for name, instructions in counts.items():
        ratio = f"{instructions / earlier[name]:.3f}" if name in earlier else "-"
        table.add_row(name, f"{instructions:,}", ratio)
    Console().print(table)


def rendered(page: str, counts: dict[str, int]) -> str:
    """Return the page with the table of the counts."""
    rows = [f"| `{name}` | {instructions:,} |" for name, instructions in counts.items()]
    before, _, after = page.partition(HEAD)
    return before + "\n".join([HEAD, "|---|---|", *rows]) + after[after.index("\n\n") :]
