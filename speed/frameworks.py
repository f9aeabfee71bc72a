"""Trainers on this package: measurements of ``examples``, and the tables of docs/trainers.md.

The folder speed/results/frameworks has one JSON document per learner. Its folder changes has one per example
with the gains of changed examples.
"""

from __future__ import annotations

import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flockesc_env.common.files import write_text
from speed import machine
from speed.page import table, with_table

RESULTS = Path("speed/results/frameworks")
PAGE = Path("docs/trainers.md")
_GAINS = ["gain over the best fixed range (m)", "seeds", "lowest to highest (m)"]
HEAD = ["learner", "versions", "samples/s", "over PettingZoo dicts", "lines", *_GAINS]
CHANGES_HEAD = ["learner", "change", *_GAINS]


@dataclass(frozen=True)
class Change:
    """A change of an example: in its text, every key is replaced by its value."""

    name: str
    replaced: dict[str, str]

    def applied(self, text: str) -> str:
        """Return the changed text of the example.

        Raises:
            ValueError: if the text does not have a key once.
        """
        for old, new in self.replaced.items():
            if text.count(old) != 1:
                raise ValueError(f"{old!r} is {text.count(old)} times in the example")
            text = text.replace(old, new)
        return text


CHANGES = {
    "torchrl_ppo": [
        Change("rewards are not scaled", {"REWARD_SCALE = 0.1": "REWARD_SCALE = 1.0"}),
        Change(
            "torch's default weights instead of orthogonal ones",
            {
                "        torch.nn.init.orthogonal_(linear.weight, layer_gain)\n": "",
                "        torch.nn.init.zeros_(linear.bias)\n": "",
            },
        ),
        Change(
            "a Gaussian squashed by tanh instead of a clipped one",
            {
                "import IndependentNormal,": "import TanhNormal,",
                "distribution_class=IndependentNormal": "distribution_class=TanhNormal",
                "layout.names)\n": 'layout.names, squash="tanh")\n',
            },
        ),
    ],
    "benchmarl_mappo": [
        Change("rewards are not scaled", {"scale=0.1": "scale=1.0"}),
        Change("minibatches of 16,200 samples instead of 6,000", {"MINIBATCH = 20 ": "MINIBATCH = 54 "}),
        Change(
            "a Gaussian squashed by tanh instead of a clipped one",
            {
                "learner.use_tanh_normal = 0.95, False": "learner.use_tanh_normal = 0.95, True",
                "ranges=ranges)": 'ranges=ranges, squash="tanh")',
            },
        ),
    ],
    "rllib_ppo": [
        Change("minibatches are not shuffled", {"            shuffle_batch_per_epoch=True,\n": ""}),
    ],
}
"""Changes of each example whose gains docs/trainers.md states."""

_SAMPLES = re.compile(r"^(\d+) samples in", re.MULTILINE)
_SPEED = re.compile(r"(\d+) samples/s$", re.MULTILINE)
_GAIN = re.compile(r"^([+-][\d.]+) m \[([+-][\d.]+), ([+-][\d.]+)\]", re.MULTILINE)
_VERSIONS = """
import importlib.metadata, json, sys
print(json.dumps({name: importlib.metadata.version(name) for name in sys.argv[1:]}))
"""


def frameworks(
    measure: str = "",
    change: str = "",
    name: str = "",
    learner: str = "",
    packages: tuple[str, ...] = (),
    python: str = sys.executable,
    arguments: str = "",
    seeds: tuple[int, ...] = (0, 1, 2),
    pettingzoo: str = "",
) -> None:
    """Write the tables of docs/trainers.md, after measuring an example or its changes if it is named.

    Args:
        measure: name of an example to run first, without ``.py``.
        change: name of an example whose ``CHANGES`` to run first.
        name: name of the result file; default: that of the example.
        learner: name of the learner in the table.
        packages: names of the packages whose versions the table states.
        python: interpreter of an environment with these packages.
        arguments: arguments of the example.
        seeds: seeds of the training runs.
        pettingzoo: its arguments for a short run through PettingZoo's dicts; empty: no such run.
    """
    example = Path("examples") / f"{measure or change}.py"
    if measure or change:
        text = example.read_text("utf-8")
        found: dict[str, Any] = {
            "learner": learner,
            "versions": json.loads(_output(python, "-c", _VERSIONS, *packages)),
            "command": f"python {example} {arguments}".strip(),
            "processor": machine.description()["cpu"],
        }
    if measure:
        _write(
            RESULTS / f"{name or measure}.json",
            {
                **found,
                "runs": [_run(python, example, arguments, seed) for seed in seeds],
                "pettingzoo": pettingzoo,
                "pettingzoo_samples_per_second": _speed(_output(python, str(example), *pettingzoo.split()))
                if pettingzoo
                else None,
                "lines": sum(bool(line.strip()) for line in text.splitlines()),
            },
        )
    if change:
        rows = []
        for each in CHANGES[change]:
            with tempfile.TemporaryDirectory() as folder:
                changed = Path(folder) / example.name
                changed.write_text(each.applied(text), "utf-8")
                runs = [_run(python, changed, arguments, seed) for seed in seeds]
            rows.append({"change": each.name, "replaced": each.replaced, "runs": runs})
        _write(RESULTS / "changes" / f"{name or change}.json", {**found, "changes": rows})
    write_text(PAGE, rendered(PAGE.read_text("utf-8")))


def rendered(page: str) -> str:
    """Return the page with the tables of all measurements."""
    learners = [json.loads(path.read_text()) for path in sorted(RESULTS.glob("*.json"))]
    changes = [json.loads(path.read_text()) for path in sorted(RESULTS.glob("changes/*.json"))]
    rows = [
        [found["learner"], row["change"], *_gains(row["runs"])]
        for found in changes
        for row in found["changes"]
    ]
    page = with_table(page, table(HEAD, [_row(found) for found in learners]))
    return with_table(page, table(CHANGES_HEAD, rows)) if rows else page


def _row(found: dict[str, Any]) -> list[str]:
    example = found["command"].split()[1]
    dicts = found["pettingzoo_samples_per_second"]
    return [
        f"{found['learner']}: [{Path(example).name}](../{example})",
        ", ".join(f"{package} {version}" for package, version in found["versions"].items()),
        f"{statistics.median(run['samples_per_second'] for run in found['runs']):,.0f}",
        "-" if dicts is None else f"{dicts:,}",
        str(found["lines"]),
        *_gains(found["runs"]),
    ]


def _gains(runs: list[dict[str, Any]]) -> list[str]:
    gains = [run["gain"] for run in runs]
    return [f"{statistics.mean(gains):+.1f}", str(len(gains)), f"{min(gains):+.1f} to {max(gains):+.1f}"]


def _run(python: str, example: Path, arguments: str, seed: int) -> dict[str, Any]:
    printed = _output(python, str(example), *arguments.split(), "--seed", str(seed))
    gain, low, high = map(float, _GAIN.findall(printed)[0])
    return {
        "seed": seed,
        "samples": int(_SAMPLES.findall(printed)[0]),
        "samples_per_second": _speed(printed),
        "gain": gain,
        "interval": [low, high],
    }


def _speed(printed: str) -> int:
    return int(_SPEED.findall(printed)[0])


def _write(path: Path, found: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(found, indent=1) + "\n")


def _output(*command: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment).stdout
