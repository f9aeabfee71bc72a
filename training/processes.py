"""Training runs in subprocesses, each on one core."""

from __future__ import annotations

import dataclasses
import os
import shlex
import subprocess
import sys
from typing import Any

from training.config import Args, train_presets


def train_apart(name: str, args: Args) -> None:
    """Start or continue a training run in a subprocess and wait for it.

    Args:
        name: name of the preset.
        args: arguments of the run; those that differ from the preset become flags.

    Raises:
        RuntimeError: if the subprocess fails.
    """
    preset = train_presets()[name]
    command = [sys.executable, "-m", "training", "train", name, "--no-progress"]
    for field in dataclasses.fields(args):
        value = getattr(args, field.name)
        if field.name != "progress" and value != getattr(preset, field.name):
            command += _flag(field.name.replace("_", "-"), value)
    one_core = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(  # noqa: S603, the command has no untrusted parts
        command, env={**os.environ, **one_core}, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{shlex.join(command)} failed:\n{done.stderr[-2000:]}")


def _flag(name: str, value: Any) -> list[str]:
    if isinstance(value, bool):
        return [f"--{name}" if value else f"--no-{name}"]
    return [f"--{name}", *(str(entry) for entry in (value if isinstance(value, tuple) else (value,)))]
