"""Training runs in processes of their own, on one core each."""

from __future__ import annotations

import dataclasses
import os
import shlex
import subprocess
import sys
from typing import Any

from training.config import Args, train_presets


def train_apart(name: str, args: Args) -> None:
    """Do, or finish, one training run.

    Args:
        name: of the learner's preset.
        args: of the run; what differs from the preset is given as flags.

    Raises:
        RuntimeError: if the run fails.
    """
    preset = train_presets()[name]
    command = [sys.executable, "-m", "training", "train", name, "--no-progress"]
    for field in dataclasses.fields(args):
        value = getattr(args, field.name)
        if field.name != "progress" and value != getattr(preset, field.name):
            command += _flag(field.name.replace("_", "-"), value)
    one_core = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(  # noqa: S603, a command of our own
        command, env={**os.environ, **one_core}, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{shlex.join(command)} failed:\n{done.stderr[-2000:]}")


def _flag(name: str, value: Any) -> list[str]:
    if isinstance(value, bool):
        return [f"--{name}" if value else f"--no-{name}"]
    return [f"--{name}", *(str(entry) for entry in (value if isinstance(value, tuple) else (value,)))]
