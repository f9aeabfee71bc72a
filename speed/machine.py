"""Description of the machine and the versions of a benchmark run."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

_PACKAGES = {
    *("flockesc-env", "gymnasium", "jax", "mpe2", "numba", "numpy", "pettingzoo", "scipy"),
    *("stable-baselines3", "torch", "vmas"),
}
_FLAGS = ("sse2", "avx", "avx2", "fma", "avx512f", "avx512dq", "avx512vl", "avx512bw")


def description() -> dict[str, Any]:
    """Return the processor, system, versions and commit."""
    cpu = _cpu()
    flags = set(cpu.get("flags", "").split())
    versions = ((found.name.replace("_", "-"), found.version) for found in distributions())
    return {
        "cpu": cpu.get("model name", platform.processor()),
        "cores": os.cpu_count(),
        "load_average": os.getloadavg()[0],  # of the last minute
        "instruction_sets": [flag for flag in _FLAGS if flag in flags],
        "system": platform.platform(),
        "python": platform.python_version(),
        "rust": _output("rustc", "--version"),
        "commit": _output("git", "describe", "--always", "--dirty", "--abbrev=40"),
        "packages": dict(sorted(pair for pair in versions if pair[0] in _PACKAGES)),
        "command": "python -m speed " + " ".join(sys.argv[1:]),
    }


def _cpu() -> dict[str, str]:
    """Return the entries of the first processor in /proc/cpuinfo; empty if the file does not exist."""
    path = Path("/proc/cpuinfo")
    if not path.exists():
        return {}
    lines = path.read_text().split("\n\n", 1)[0].splitlines()
    return {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}


def _output(*command: str) -> str | None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(__file__).parent)
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout.strip()
