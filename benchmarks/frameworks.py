"""Trainers on this package: measurements of ``examples``, and the table of docs/trainers.md.

results/frameworks has one JSON document per example; its name is that of the example.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks import machine
from benchmarks.page import table, with_table
from flockesc_env.common.files import write_text

RESULTS = Path("results/frameworks")
PAGE = Path("docs/trainers.md")
HEAD = [
    "example",
    "versions",
    "samples/s",
    "over PettingZoo dicts",
    "lines",
    "gain over the best fixed range (m)",
]

_SPEED = re.compile(r"(\d+) samples/s$", re.MULTILINE)
_GAIN = re.compile(r"^([+-][\d.]+) m \[([+-][\d.]+), ([+-][\d.]+)\]", re.MULTILINE)
_VERSIONS = """
import importlib.metadata, json, sys
print(json.dumps({name: importlib.metadata.version(name) for name in sys.argv[1:]}))
"""


def frameworks(
    measure: str = "",
    framework: str = "",
    packages: tuple[str, ...] = (),
    python: str = sys.executable,
    arguments: str = "--seed 0",
    pettingzoo: str = "",
) -> None:
    """Write the table of docs/trainers.md, after measuring one example if it is named.

    Args:
        measure: name of an example to run first, without ``.py``.
        framework: name of its framework in the table.
        packages: names of the packages whose versions the table states.
        python: interpreter of an environment with these packages.
        arguments: arguments of the example.
        pettingzoo: its arguments for a short run through PettingZoo's dicts; empty: no such run.
    """
    if measure:
        example = f"examples/{measure}.py"
        found = {
            "framework": framework,
            "versions": json.loads(_output(python, "-c", _VERSIONS, *packages)),
            **_measured(python, example, arguments, pettingzoo),
            "lines": sum(bool(line.strip()) for line in Path(example).read_text("utf-8").splitlines()),
            "processor": machine.description()["cpu"],
        }
        RESULTS.mkdir(parents=True, exist_ok=True)
        write_text(RESULTS / f"{measure}.json", json.dumps(found, indent=1) + "\n")
    write_text(PAGE, rendered(PAGE.read_text("utf-8")))


def rendered(page: str) -> str:
    """Return the page with the table of all measurements."""
    return with_table(
        page, table(HEAD, [_row(json.loads(p.read_text())) for p in sorted(RESULTS.glob("*.json"))])
    )


def _row(found: dict[str, Any]) -> list[str]:
    example = found["command"].split()[1]
    versions = ", ".join(f"{package} {version}" for package, version in found["versions"].items())
    dicts = found["pettingzoo_samples_per_second"]
    low, high = found["interval"]
    return [
        f"{found['framework']}: [{Path(example).name}](../{example})",
        versions,
        f"{found['samples_per_second']:,}",
        "-" if dicts is None else f"{dicts:,}",
        str(found["lines"]),
        f"{found['gain']:+.1f} [{low:+.1f}, {high:+.1f}]",
    ]


def _measured(python: str, example: str, arguments: str, pettingzoo: str) -> dict[str, Any]:
    printed = _output(python, example, *arguments.split())
    gain, low, high = map(float, _GAIN.findall(printed)[0])
    command, dicts = f"python {example} {arguments}", None
    if pettingzoo:
        dicts = int(_SPEED.findall(_output(python, example, *pettingzoo.split()))[0])
        command += f"; python {example} {pettingzoo}"
    seed = re.search(r"--seed (\d+)", arguments)
    return {
        "command": command,
        "seed": int(seed[1]) if seed else None,
        "samples_per_second": int(_SPEED.findall(printed)[0]),
        "pettingzoo_samples_per_second": dicts,
        "gain": gain,
        "interval": [low, high],
    }


def _output(*command: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment).stdout
