"""Trainers on this package: measurements of ``examples``, and the table of docs/trainers.md.

results/frameworks has one JSON document per example; its name is that of the example.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import machine
from flockesc_env.common.files import write_text

RESULTS = Path("results/frameworks")
PAGE = Path("docs/trainers.md")
HEAD = (
    "| example | versions | samples/s | over PettingZoo dicts | lines | gain over the best fixed range (m) |"
)

_SPEED = re.compile(r"(\d+) samples/s$", re.MULTILINE)
_GAIN = re.compile(r"^([+-][\d.]+) m \[([+-][\d.]+), ([+-][\d.]+)\]", re.MULTILINE)
_VERSIONS = """
import importlib.metadata, json, sys
print(json.dumps({name: importlib.metadata.version(name) for name in sys.argv[1:]}))
"""


@dataclass(frozen=True)
class FrameworksArgs:
    """Arguments of ``frameworks``. Without ``measure`` the table is written from earlier measurements.

    Attributes:
        measure: name of an example to run first, without ``.py``.
        framework: name of its framework in the table.
        packages: names of the packages whose versions the table states.
        python: interpreter of an environment with these packages.
        arguments: arguments of the example.
        pettingzoo: its arguments for a short run through PettingZoo's dicts; empty: no such run.
    """

    measure: str = ""
    framework: str = ""
    packages: tuple[str, ...] = ()
    python: str = sys.executable
    arguments: str = "--seed 0"
    pettingzoo: str = ""


def run(args: FrameworksArgs) -> None:
    """Run an example if one is named, and write the table."""
    if args.measure:
        document = json.dumps(_measured(args), indent=1) + "\n"
        RESULTS.mkdir(parents=True, exist_ok=True)
        write_text(RESULTS / f"{args.measure}.json", document)
    write_text(PAGE, rendered(PAGE.read_text("utf-8")))


def rendered(page: str) -> str:
    """Return the page with the table of all measurements."""
    rows = [_row(json.loads(path.read_text())) for path in sorted(RESULTS.glob("*.json"))]
    before, _, after = page.partition(HEAD)
    rest = after[after.index("\n\n") :]
    return before + "\n".join([HEAD, re.sub("[^|]+", "---", HEAD), *rows]) + rest


def _row(found: dict[str, Any]) -> str:
    example = found["command"].split()[1]
    versions = ", ".join(f"{package} {version}" for package, version in found["versions"].items())
    dicts = found["pettingzoo_samples_per_second"]
    low, high = found["interval"]
    cells = (
        f"{found['framework']}: [{Path(example).name}](../{example})",
        versions,
        f"{found['samples_per_second']:,}",
        "-" if dicts is None else f"{dicts:,}",
        str(found["lines"]),
        f"{found['gain']:+.1f} [{low:+.1f}, {high:+.1f}]",
    )
    return f"| {' | '.join(cells)} |"


def _measured(args: FrameworksArgs) -> dict[str, Any]:
    example = f"examples/{args.measure}.py"
    printed = _output(args.python, example, *args.arguments.split())
    gain, low, high = map(float, _GAIN.findall(printed)[0])
    command, dicts = f"python {example} {args.arguments}", None
    if args.pettingzoo:
        dicts = int(_SPEED.findall(_output(args.python, example, *args.pettingzoo.split()))[0])
        command += f"; python {example} {args.pettingzoo}"
    seed = re.search(r"--seed (\d+)", args.arguments)
    return {
        "framework": args.framework,
        "versions": json.loads(_output(args.python, "-c", _VERSIONS, *args.packages)),
        "command": command,
        "seed": int(seed[1]) if seed else None,
        "samples_per_second": int(_SPEED.findall(printed)[0]),
        "pettingzoo_samples_per_second": dicts,
        "lines": sum(bool(line.strip()) for line in Path(example).read_text("utf-8").splitlines()),
        "gain": gain,
        "interval": [low, high],
        "processor": machine.description()["cpu"],
    }


def _output(*command: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment).stdout
