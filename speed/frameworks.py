"""Trainers on this package: runs of ``examples``, and the tables of speed/results/README.md.

A JSON document in speed/results/frameworks describes a learner and holds its measurements. A document in the
folder ``changes`` does so for changes of an example: in its text, every key of ``replaced`` is replaced by
its value. To measure another learner, copy a document and change what describes it.
"""

import json
import re
import statistics
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from flockesc_env.common.files import write_text
from speed.measure import machine, output
from speed.page import REPORT, table, with_table

RESULTS = Path("speed/results/frameworks")
_GAINS = ["gain over the best fixed range (m)", "seeds", "lowest to highest (m)"]

Document = dict[str, Any]

# What an example prints at its end.
_SPEED = re.compile(r"^(\d+) samples in .* (\d+) samples/s$", re.MULTILINE)
_GAIN = re.compile(r"^([+-][\d.]+) m \[([+-][\d.]+), ([+-][\d.]+)\]", re.MULTILINE)


def frameworks(measure: tuple[Path, ...] = (), python: str = sys.executable) -> None:
    """Write the tables of speed/results/README.md, after measuring the learners of some documents again.

    Args:
        measure: documents in speed/results/frameworks, which get the new measurements.
        python: interpreter of an environment with the packages of the documents.
    """
    for path in measure:
        write_text(path, json.dumps(_measured(json.loads(path.read_text()), python), indent=1) + "\n")
    write_text(REPORT, rendered(REPORT.read_text("utf-8")))


def changed(text: str, replaced: dict[str, str]) -> str:
    """Return the text of an example, with every key replaced by its value.

    Raises:
        ValueError: if the text does not have a key once.
    """
    for old, new in replaced.items():
        if text.count(old) != 1:
            raise ValueError(f"{old!r} is {text.count(old)} times in the example")
        text = text.replace(old, new)
    return text


def rendered(page: str) -> str:
    """Return the page with the tables of all measurements."""
    learners, changes = (
        [json.loads(path.read_text()) for path in sorted(RESULTS.glob(files))]
        for files in ("*.json", "changes/*.json")
    )
    head = ["learner", "versions", "samples/s", "over PettingZoo dicts", "lines", *_GAINS]
    page = with_table(page, table(head, [_row(document) for document in learners]))
    pairs = ((document["learner"], row) for document in changes for row in document["changes"])
    rows = [[learner, row["change"], *_gains(row["runs"])] for learner, row in pairs]
    return with_table(page, table(["learner", "change", *_GAINS], rows))


def _row(document: Document) -> list[str]:
    example = document["command"].split()[1]
    dicts = document["pettingzoo_samples_per_second"]
    return [
        f"{document['learner']}: [{Path(example).name}](../../{example})",
        ", ".join(f"{package} {number}" for package, number in document["versions"].items()),
        f"{statistics.median(run['samples_per_second'] for run in document['runs']):,.0f}",
        "-" if dicts is None else f"{dicts:,}",
        str(document["lines"]),
        *_gains(document["runs"]),
    ]


def _gains(runs: list[Document]) -> list[str]:
    gains = [run["gain"] for run in runs]
    return [f"{statistics.mean(gains):+.1f}", str(len(gains)), f"{min(gains):+.1f} to {max(gains):+.1f}"]


def _measured(document: Document, python: str) -> Document:
    """Return the document with new measurements, for the seeds of the earlier ones."""
    words = document["command"].split()  # may set environment variables first
    example = next(word for word in words if word.endswith(".py"))
    text = Path(example).read_text("utf-8")
    packages = list(document["versions"])
    script = "import sys, importlib.metadata as m; print(*map(m.version, sys.argv[1:]))"
    versions = output(python, "-c", script, *packages).split()
    document["versions"] = dict(zip(packages, versions, strict=True))
    document["processor"] = machine()["cpu"]
    for entry in document.get("changes", [document]):
        with TemporaryDirectory() as folder:
            file = Path(folder, Path(example).name)
            file.write_text(changed(text, entry.get("replaced", {})), "utf-8")
            command = [{"python": python, example: str(file)}.get(word, word) for word in words]
            entry["runs"] = [_run(command, run["seed"]) for run in entry["runs"]]
    if "lines" in document:
        document["lines"] = sum(bool(line.strip()) for line in text.splitlines())
        if arguments := document["pettingzoo"].split():
            _, speed = _SPEED.findall(output(python, example, *arguments))[0]
            document["pettingzoo_samples_per_second"] = int(speed)
    return document


def _run(command: list[str], seed: int) -> Document:
    printed = output("env", *command, "--seed", str(seed))
    samples, speed = map(int, _SPEED.findall(printed)[0])
    gain, low, high = map(float, _GAIN.findall(printed)[0])
    interval = [low, high]
    return {"seed": seed, "samples": samples, "samples_per_second": speed, "gain": gain, "interval": interval}
