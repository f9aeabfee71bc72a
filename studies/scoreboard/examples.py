"""Baselines of other frameworks: the examples of this project, each in the environment of its framework."""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from flockesc_env.jobs import Arrays

_MARL: Final = ("benchmarl", "torchrl", "torch")
_COMMANDS: Final[Mapping[str, tuple[str, str, tuple[str, ...]]]] = {
    "one-file-ppo": (".venv", "examples/ppo_single_file.py", ("torch",)),
    "torchrl-ippo": (".compat/torchrl", "examples/torchrl_ppo.py", ("torchrl", "torch")),
    "benchmarl-ippo": (".compat/benchmarl", "examples/benchmarl_mappo.py --algorithm ippo", _MARL),
    "benchmarl-mappo": (".compat/benchmarl", "examples/benchmarl_mappo.py --algorithm mappo", _MARL),
    "benchmarl-iql": (".compat/benchmarl", "examples/benchmarl_mappo.py --algorithm iql", _MARL),
    "rllib-ppo": (".compat/rllib", "examples/rllib_ppo.py", ("ray", "torch")),
}
"""Virtual environment, script and packages of every learner; `make compat-NAME` creates .compat/NAME."""

_TASK: Final = "per-agent-visible"  # the examples train on its scenario and options
SEEDS: Final[Mapping[str, Mapping[str, int]]] = {
    "one-file-ppo": {_TASK: 5},
    "torchrl-ippo": {_TASK: 5},
    "benchmarl-ippo": {_TASK: 5},
    "benchmarl-mappo": {_TASK: 5},
    "benchmarl-iql": {_TASK: 5},
    "rllib-ppo": {_TASK: 3},
}
"""Number of training seeds by learner and task."""

_SPEED: Final = re.compile(r"(\d+) samples in ([\d.]+) s of CPU time")


def command(learner: str, seed: int) -> str:
    """Return the command of a training run, without its output file."""
    environment, script, _ = _COMMANDS[learner]
    return f"{environment}/bin/python {script} --seed {seed}"


def versions_of(learner: str) -> dict[str, str]:
    """Return the versions of a learner's packages in its environment."""
    environment, _, packages = _COMMANDS[learner]
    return versions(f"{environment}/bin/python", packages)


def versions(python: str, packages: Sequence[str]) -> dict[str, str]:
    """Return the versions of packages in the environment of an interpreter."""
    code = "import sys, importlib.metadata as m; print(*map(m.version, sys.argv[1:]))"
    ran = subprocess.run([python, "-c", code, *packages], check=True, capture_output=True, text=True)  # noqa: S603
    return dict(zip(packages, ran.stdout.split(), strict=True))


def train(learner: str, _: str, seed: int) -> Arrays:
    """Run an example; return the bytes of its policy file, the samples and the processor time."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "policy.npz"
        environment = {**os.environ, "PYTHONPATH": str(Path.cwd()), "OMP_NUM_THREADS": "1"}
        ran = subprocess.run(  # noqa: S603, the commands are constants
            [*command(learner, seed).split(), "--held-out", "2", "--output", str(file)],
            check=True,
            capture_output=True,
            text=True,
            env=environment,
        )
        samples, seconds = _SPEED.findall(ran.stdout)[-1]
        return {
            "policy": np.frombuffer(file.read_bytes(), np.uint8),
            "samples": np.array(int(samples)),
            "cpu_seconds": np.array(float(seconds)),
        }
